bielle_test(lq SOURCES test_lq.cpp LIBS bielle_solve)
