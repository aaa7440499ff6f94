# The installation: headers, one library per layer, robots, the command, and the package `find_package(bielle)` finds.
# Two components: `command` is what runs, `development` what others build with.
include(CMakePackageConfigHelpers)

get_property(layers GLOBAL PROPERTY BIELLE_LAYERS)
add_library(bielle_all INTERFACE)
add_library(bielle::bielle ALIAS bielle_all)
set_target_properties(bielle_all PROPERTIES EXPORT_NAME bielle)
target_link_libraries(bielle_all INTERFACE ${layers})

install(DIRECTORY robots/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bielle/robots COMPONENT command)
install(FILES LICENSE README.md CHANGELOG.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT command)
install(TARGETS bielle_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
if(BIELLE_BUILD_VALIDATION)
  install(TARGETS bielle-validate bielle-check RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
endif()
install(FILES completions/bielle.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME bielle
  COMPONENT command)
install(FILES completions/_bielle DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions COMPONENT command)
include(cmake/man.cmake)

install(DIRECTORY include/bielle DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(TARGETS ${layers} bielle_all EXPORT bielleTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/bielle)
install(EXPORT bielleTargets NAMESPACE bielle:: DESTINATION ${package} COMPONENT development)
configure_package_config_file(cmake/bielleConfig.cmake.in ${PROJECT_BINARY_DIR}/bielleConfig.cmake
  INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/bielleConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/bielleConfig.cmake ${PROJECT_BINARY_DIR}/bielleConfigVersion.cmake
  DESTINATION ${package} COMPONENT development)
include(cmake/pkgconfig.cmake)
include(cmake/package.cmake)
