bielle_command_test(compare SOURCES test_compare.cpp LIBS bielle_results)
