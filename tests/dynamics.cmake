bielle_test(dynamics SOURCES test_dynamics.cpp mechanisms.cpp LIBS bielle_dynamics)
