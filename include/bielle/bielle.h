#pragma once
/// \file What a program needs that reads a robot, makes a motion, solves it and writes what came out.
#include "bielle/io/result.h"
#include "bielle/model/reader.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/sequence.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/report/report.h"
