# Manual pages, made from the help of the commands that have been built.
find_program(AWK NAMES awk mawk gawk)
if(UNIX AND AWK AND NOT CMAKE_CROSSCOMPILING)
  set(man_pages ${PROJECT_BINARY_DIR}/man)
  set(man_scripts ${PROJECT_SOURCE_DIR}/cmake/make_man.sh ${PROJECT_SOURCE_DIR}/cmake/help_to_man.awk)
  add_custom_command(OUTPUT ${man_pages}/bielle.1
    COMMAND ${PROJECT_SOURCE_DIR}/cmake/make_man.sh $<TARGET_FILE:bielle_command> ${PROJECT_VERSION} ${man_pages}
    DEPENDS ${programs} ${man_scripts}
    COMMENT "Manual pages" VERBATIM)
  add_custom_target(man ALL DEPENDS ${man_pages}/bielle.1)
  install(DIRECTORY ${man_pages}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT command FILES_MATCHING PATTERN "*.1")
endif()
