bielle_test(bench SOURCES test_bench.cpp LIBS bielle_bench)
set_tests_properties(bench PROPERTIES LABELS unit)  # whole motions: minutes under sanitizers
