bielle_test(policy SOURCES test_policy.cpp LIBS bielle_control)
bielle_test(contact_filter SOURCES test_contact_filter.cpp LIBS bielle_control)
bielle_test(estimator SOURCES test_estimator.cpp LIBS bielle_control)
bielle_test(window_grid SOURCES test_window_grid.cpp LIBS bielle_control)
