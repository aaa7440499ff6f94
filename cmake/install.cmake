# The installation: headers, libraries, robots, the command, and the package `find_package(bielle)` finds.
# Components: `command` is what runs, `library` the shared library, `development` what others build with, `workers` the one
# program that is under the GPL where it is given away.
include(CMakePackageConfigHelpers)

get_property(layers GLOBAL PROPERTY BIELLE_LAYERS)
add_library(bielle_all INTERFACE)
add_library(bielle::bielle ALIAS bielle_all)
set_target_properties(bielle_all PROPERTIES EXPORT_NAME bielle)
target_link_libraries(bielle_all INTERFACE ${layers})

install(DIRECTORY robots/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bielle/robots COMPONENT command)
install(FILES LICENSE README.md CHANGELOG.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT command)
get_property(companions GLOBAL PROPERTY BIELLE_COMPANIONS)
set(programs bielle_command ${companions})
if(BIELLE_BUILD_VALIDATION)
  list(APPEND programs bielle-validate bielle-check bielle-check-complete)
endif()
if(TARGET bielle-workers)
  install(TARGETS bielle-workers RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT workers)
endif()
# What the programs may build at their first use (formats/companion.h).
set(companions ${programs})
if(TARGET bielle-workers)
  list(APPEND companions bielle-workers)
endif()
list(JOIN companions "\n" companions)
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/companions.txt CONTENT "${companions}\n")
set(packaged ${programs})
if(TARGET bielle-identify)
  # In no package: with Debian's Ceres comes SuiteSparse, of which parts are under the GPL.
  list(REMOVE_ITEM packaged bielle-identify)
  install(TARGETS bielle-identify RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT identify)
endif()
install(TARGETS ${packaged} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
install(PROGRAMS src/cli/dxf/bielle_dxf.py DESTINATION ${CMAKE_INSTALL_BINDIR} RENAME bielle-dxf COMPONENT command)
if(BUILD_SHARED_LIBS)
  set_target_properties(${programs} PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
endif()
install(FILES completions/bielle.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME bielle
  COMPONENT command)
install(FILES completions/_bielle DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions COMPONENT command)
include(cmake/man.cmake)

install(DIRECTORY include/bielle DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(TARGETS bielle_headers ${layers} bielle_all EXPORT bielleTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
if(BUILD_SHARED_LIBS)
  install(TARGETS bielle_library EXPORT bielleTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
  foreach(level IN LISTS BIELLE_LEVELS)
    install(TARGETS bielle_library_${level}
      LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/glibc-hwcaps/${level} COMPONENT library NAMELINK_SKIP)
  endforeach()
endif()
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/bielle)
install(EXPORT bielleTargets NAMESPACE bielle:: DESTINATION ${package} COMPONENT development)
configure_package_config_file(cmake/bielleConfig.cmake.in ${PROJECT_BINARY_DIR}/bielleConfig.cmake
  INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/bielleConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/bielleConfig.cmake ${PROJECT_BINARY_DIR}/bielleConfigVersion.cmake
  DESTINATION ${package} COMPONENT development)
include(cmake/pkgconfig.cmake)
include(cmake/package.cmake)
