# Two tiers. `scripts/test.sh` builds and runs what is not labelled `long`: it tells a user that this build is right on this
# machine. `scripts/test.sh --all` builds and runs everything. Labelled `long` are
# - the tests that are listed here;
# - NAME_long, the cases of the test NAME that are tagged [long], and those tagged [sweep] with all their mechanisms, of which
#   NAME tries a share (tests/selection.h); in Python, what is marked `pytest.mark.long`. CMake adds these tests where a file has
#   such tags.
# docs/results/wait.md lists both tiers; the test `tiers` finds what would be in neither.
set(bielle_long_tests
  # Further motions of the command: the first tier solves one of each.
  check_walk_0.3 check_walk_0.8 check_walk_full check_walk_rigid check_stairs_down check_box_down check_jump_forward check_run_fast
  check_hops check_sequence_default
  # Whole motions in the library.
  formulations objectives timed_motions envelope predictive_feet
  # Differences over every mechanism and discretization.
  energy timings
  # Thousands of wrong files, and numbers that nobody should ask for.
  mutated_robots hostile_numbers remedies
  # Robots in other programs, of which the first tier has a few on the page README.md.
  validate_robots validate_springs
  # Designs and robots of parts, of which the first tier has short ones (design, design_parts, synthesize, documents_design_reference).
  design_goals design_fronts design_gradient design_constraints part_motions python_design design_page documents_design documents_parts
  # Whole runs of commands, beside those of their pages.
  firmware_all simulate_predictive dataset interruptions determinism_long place_long results_alone_long carried_goals_long
  # Tasks on other machines, for which Work Queue must be there.
  workers documents_workers
  # Programs that are not installed: IPOPT beside our solver, the paper, the benchmarks of loops, the examples, whose texts the
  # pages show.
  ipopt protocol_ipopt stationarity paper_claims paper_jump paper_residuals paper_study paper_walk loops_motions loops_mechanisms loops_trials
  01_fourbar 02_squat 03_walk 04_stairs 05_jump 06_lift 07_own_motion 08_turn 09_sequence 10_sensitivity 11_own_constraint
  12_controller 13_beam springs_figure documents_new_motion python_notebooks
  # A few rows of each page of results.
  results_architectures results_checks results_dataset results_execution results_formulations results_loops results_motions
  results_objectives results_scaling results_speed results_suite results_synthesis results_turn results_batch results_batch_builds
  results_batch_ends results_learn
  # What is given away: packages, libraries for every machine, the pages of Doxygen.
  install package portable doxygen)

# What takes longest begins first, so that no core waits for it in the end: CTest knows that by itself from the second run on.
set(bielle_slow_tests
  place_long parallel_bipeds_long results_alone_long results_architectures check edge_feet_long workers report_page
  interruptions mutated_robots reduced_long simulate_predictive check_sequence_default
  # Under the sanitizers.
  reduced policy bielle_world mujoco_world ocp_problem)

# bielle_set_tiers(): at the end of each directory that adds tests.
function(bielle_set_tiers)
  foreach(test IN LISTS bielle_slow_tests)
    if(TEST ${test})
      set_property(TEST ${test} PROPERTY COST 100)
    endif()
  endforeach()
  foreach(test IN LISTS bielle_long_tests)
    if(TEST ${test})
      get_property(labels TEST ${test} PROPERTY LABELS)
      list(REMOVE_ITEM labels unit system memory)
      set_property(TEST ${test} PROPERTY LABELS ${labels} long)
    endif()
  endforeach()
endfunction()

# bielle_add_cases(NAME TARGET LABELS FILES...): a test of CTest that runs the cases of these files of an executable of Catch2,
# but for hidden ones (`[.table]`, `[.time]`), which are for the reader; and NAME_long, if they have tags of it.
function(bielle_add_cases name target labels)
  set(short)
  set(long)
  foreach(file IN LISTS ARGN)
    get_filename_component(stem ${file} NAME_WE)
    list(APPEND short "[#${stem}]~[.]~[long]")
    list(APPEND long "[#${stem}][long]" "[#${stem}][sweep]")
    file(STRINGS ${file} tagged REGEX "\\[(long|sweep)\\]")
    string(APPEND tags "${tagged}")
  endforeach()
  string(REPLACE ";" "," short "${short}")
  string(REPLACE ";" "," long "${long}")
  add_test(NAME ${name} COMMAND ${target} --filenames-as-tags ${short})
  set_tests_properties(${name} PROPERTIES LABELS "${labels}")
  if(BIELLE_SANITIZE)
    set_tests_properties(${name} PROPERTIES ENVIRONMENT BIELLE_SWEEP=few)
  endif()
  if(tags)
    add_test(NAME ${name}_long COMMAND ${target} --filenames-as-tags ${long})
    set_tests_properties(${name}_long PROPERTIES LABELS long ENVIRONMENT BIELLE_SWEEP=all)
  endif()
endfunction()

# bielle_list_targets(DIRECTORY VARIABLE): what `all` builds of a directory and of those below it.
function(bielle_list_targets directory variable)
  get_property(targets DIRECTORY ${directory} PROPERTY BUILDSYSTEM_TARGETS)
  set(found)
  foreach(target IN LISTS targets)
    get_target_property(is_left_out ${target} EXCLUDE_FROM_ALL)
    get_target_property(type ${target} TYPE)
    if(NOT is_left_out AND NOT type STREQUAL INTERFACE_LIBRARY)
      list(APPEND found ${target})
    endif()
  endforeach()
  get_property(below DIRECTORY ${directory} PROPERTY SUBDIRECTORIES)
  foreach(each IN LISTS below)
    bielle_list_targets(${each} of_each)
    list(APPEND found ${of_each})
  endforeach()
  set(${variable} ${found} PARENT_SCOPE)
endfunction()
