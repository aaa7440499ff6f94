#pragma once
/// \file Everything a program needs to read a robot, make a motion, solve it and write the result.
#include "bielle/motion/jump.h"
#include "bielle/motion/registry.h"
#include "bielle/motion/run.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/report/report.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
