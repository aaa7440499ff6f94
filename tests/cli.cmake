bielle_test(cli SOURCES test_cli.cpp run_command.cpp LIBS bielle_io)
target_link_libraries(test_cli PRIVATE nlohmann_json::nlohmann_json)
target_compile_definitions(test_cli PRIVATE BIELLE_COMMAND="$<TARGET_FILE:bielle_command>")
add_dependencies(test_cli bielle_command)
# The whole path from a program to its motion: not for the builds with sanitizers.
set_tests_properties(cli PROPERTIES LABELS system)

# An installation is found, linked and run by a project of its own. It takes what has been built.
add_test(NAME install COMMAND ${CMAKE_COMMAND}
  -DBUILD=${PROJECT_BINARY_DIR} -DSOURCE=${CMAKE_CURRENT_SOURCE_DIR}/consumer -DWORK=${CMAKE_CURRENT_BINARY_DIR}/install
  -DCXX=${CMAKE_CXX_COMPILER} -DGENERATOR=${CMAKE_GENERATOR} -DCONFIG=$<CONFIG>
  -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/check_install.cmake)
set_tests_properties(install PROPERTIES LABELS system)
