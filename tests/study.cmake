bielle_command_test(study SOURCES test_study.cpp LIBS bielle_io)
target_link_libraries(test_study PRIVATE nlohmann_json::nlohmann_json)

bielle_command_test(compare SOURCES test_compare.cpp LIBS bielle_io)

bielle_test(claims SOURCES test_claims.cpp LIBS bielle_study)
