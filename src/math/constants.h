#pragma once

namespace bielle {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;  // rad

}  // namespace bielle
