bielle_test(ratio SOURCES test_ratio.cpp LIBS bielle_transmission bielle_robots)
bielle_test(serial SOURCES test_serial.cpp LIBS bielle_transmission)
bielle_command_test(transmission_cli SOURCES test_transmission_cli.cpp LIBS bielle_io)
