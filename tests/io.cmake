find_package(Python3 REQUIRED COMPONENTS Interpreter)
bielle_test(io SOURCES test_io.cpp LIBS bielle_io)
target_compile_definitions(test_io PRIVATE BIELLE_PYTHON="${Python3_EXECUTABLE}")
bielle_test(warm_start SOURCES test_warm_start.cpp LIBS bielle_io)
