bielle_test(study SOURCES test_study.cpp LIBS bielle_io)
target_link_libraries(test_study PRIVATE nlohmann_json::nlohmann_json)
target_compile_definitions(test_study PRIVATE BIELLE_COMMAND="$<TARGET_FILE:bielle_command>")
add_dependencies(test_study bielle_command)
set_tests_properties(study PROPERTIES LABELS system)

bielle_test(compare SOURCES test_compare.cpp LIBS bielle_io)
target_compile_definitions(test_compare PRIVATE BIELLE_COMMAND="$<TARGET_FILE:bielle_command>")
add_dependencies(test_compare bielle_command)
set_tests_properties(compare PROPERTIES LABELS system)

bielle_test(claims SOURCES test_claims.cpp LIBS bielle_study)
