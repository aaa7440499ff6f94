bielle_test(design SOURCES test_design.cpp robot_directory.cpp run_command.cpp LIBS bielle_design)
target_compile_definitions(test_design PRIVATE BIELLE_COMMAND="$<TARGET_FILE:bielle_command>")
add_dependencies(test_design bielle_command)
set_tests_properties(design PROPERTIES LABELS system)
