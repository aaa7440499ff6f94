#pragma once
// Sine, cosine and arctangent. Those of single precision have the same bits on every machine, unlike those of C libraries: newlib
// 3.3 on a Cortex-M4F differs from glibc 2.36 in a tenth of all arguments of sinf.
#include <cmath>
#include <string>

namespace bielle::firmware {

float calcSine(float x);
float calcCosine(float x);
float calcArctangent(float y, float x);
inline double calcSine(double x) { return std::sin(x); }
inline double calcCosine(double x) { return std::cos(x); }
inline double calcArctangent(double y, double x) { return std::atan2(y, x); }

// Their text in C99: `sine` or `arctangent`.
const std::string& getSingleFunction(const std::string& name);

}  // namespace bielle::firmware
