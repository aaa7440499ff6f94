bielle_test(model SOURCES test_model.cpp LIBS bielle_model)
bielle_test(reader SOURCES test_reader.cpp robot_directory.cpp LIBS bielle_model)
bielle_test(reader_errors SOURCES test_reader_errors.cpp robot_directory.cpp LIBS bielle_model)
bielle_test(robots SOURCES test_robots.cpp LIBS bielle_model)
