bielle_command_test(study SOURCES test_study.cpp LIBS bielle_io)

bielle_command_test(compare SOURCES test_compare.cpp LIBS bielle_io)

bielle_test(claims SOURCES test_claims.cpp LIBS bielle_study)
