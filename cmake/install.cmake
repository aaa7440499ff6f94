# The installation: headers, one library per layer, robots, the command, and the package `find_package(bielle)` finds.
include(CMakePackageConfigHelpers)

get_property(layers GLOBAL PROPERTY BIELLE_LAYERS)
add_library(bielle_all INTERFACE)
add_library(bielle::bielle ALIAS bielle_all)
set_target_properties(bielle_all PROPERTIES EXPORT_NAME bielle)
target_link_libraries(bielle_all INTERFACE ${layers})

install(DIRECTORY include/bielle DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY robots/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bielle/robots)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(TARGETS bielle_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ${layers} bielle_all EXPORT bielleTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/bielle)
install(EXPORT bielleTargets NAMESPACE bielle:: DESTINATION ${package})
configure_package_config_file(cmake/bielleConfig.cmake.in ${PROJECT_BINARY_DIR}/bielleConfig.cmake
  INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/bielleConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/bielleConfig.cmake ${PROJECT_BINARY_DIR}/bielleConfigVersion.cmake
  DESTINATION ${package})
