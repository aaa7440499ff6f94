bielle_test(ocp_residuals SOURCES test_ocp_residuals.cpp LIBS bielle_ocp)
bielle_test(ocp_problem SOURCES test_ocp_problem.cpp LIBS bielle_motion)
bielle_test(ocp_contract SOURCES test_ocp_contract.cpp LIBS bielle_motion)
bielle_test(lanes SOURCES test_lanes.cpp LIBS bielle_motion)
bielle_test(reduced SOURCES test_reduced.cpp LIBS bielle_motion bielle_robots)
# Under the sanitizers it takes many times as long, even with a share of the mechanisms.
set_tests_properties(reduced PROPERTIES TIMEOUT 3600)
bielle_test(path_constraints SOURCES test_path_constraints.cpp LIBS bielle_motion)
bielle_test(timings SOURCES test_timings.cpp LIBS bielle_motion)
# Every duration is optimized again and again: many minutes under sanitizers.
set_tests_properties(timings PROPERTIES LABELS system)
bielle_test(energy SOURCES test_energy.cpp LIBS bielle_motion)
# Differences over every mechanism and discretization: many minutes under sanitizers.
set_tests_properties(energy PROPERTIES LABELS system)
