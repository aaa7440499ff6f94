bielle_test(bench SOURCES test_bench.cpp LIBS bielle_bench)
