#pragma once
// What engines in programs of their own share: the mechanism as bielle-loops describes it, and the talk with it.
//
// A program reads and writes lines of JSON. The first one that comes is the mechanism (process_world.cpp), each further one a
// request, which is answered by the state:
//     {"q": [..], "v": [..]}                     starts there, without torques
//     {"forces": [..]}                           generalized forces, held from now on
//     {"step": h, "count": n}                    n steps of h
//     -> {"q": [..], "v": [..], "cpu": s}        cpu: processor time of the steps, or {"error": why}
// These programs see nothing of Bielle: its headers set the alignment of Eigen's numbers otherwise than DART was compiled.
#include <Eigen/Dense>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "processor_clock.h"

namespace bielle::outside {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using nlohmann::json;

enum class Kind { Hinge, Slide, Universal };

// With its joint, which has one coordinate, or two if universal. Body 0 is the world and has none.
struct Body {
  Kind kind = Kind::Hinge;
  int parent = 0, index = 0;  // index: of its first coordinate
  Isometry3d X_PJ = Isometry3d::Identity();
  Vector3d axis, axis2;  // in the frame of the joint; the second one moves with the first
  double mass = 0;
  Vector3d com;
  Matrix3d moments;  // about the centre of mass

  Isometry3d calcMotion(const VectorXd& q) const {
    if (kind == Kind::Slide) return Isometry3d(Eigen::Translation3d(q[index] * axis));
    Isometry3d X(Eigen::AngleAxisd(q[index], axis));
    if (kind == Kind::Universal) X.rotate(Eigen::AngleAxisd(q[index + 1], axis2));
    return X;
  }
};

// Points of two bodies that coincide; of a hinge, the axis in body 1 too.
struct Closure {
  int body1 = 0, body2 = 0;
  Vector3d point1, point2, axis = Vector3d::Zero();
  bool is_hinge = false;
};

struct Spring {
  int body1 = 0, body2 = 0;
  Vector3d point1, point2;
  double stiffness = 0, rest = 0, preload = 0, damping = 0;

  // On point 1, at places x and with velocities v of the points.
  Vector3d calcForce(const Vector3d& x1, const Vector3d& v1, const Vector3d& x2, const Vector3d& v2) const {
    const Vector3d line = x2 - x1, along = line.normalized();
    return (preload + stiffness * (line.norm() - rest) + damping * along.dot(v2 - v1)) * along;
  }
};

struct Mechanism {
  Vector3d gravity;
  int size = 0;  // coordinates
  std::vector<Body> bodies;
  std::vector<Closure> closures;
  std::vector<Spring> springs;
};

inline VectorXd readVector(const json& j) {
  VectorXd x(j.size());
  for (size_t i = 0; i < j.size(); ++i) x[static_cast<Eigen::Index>(i)] = j[i].get<double>();
  return x;
}
inline Matrix3d readMatrix(const json& j) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(readVector(j).data());
}
inline std::vector<double> list(const VectorXd& x) { return {x.data(), x.data() + x.size()}; }

inline Mechanism readMechanism(const json& j) {
  Mechanism out;
  out.gravity = readVector(j["gravity"]);
  out.bodies.emplace_back();
  for (const json& entry : j["bodies"]) {
    Body body;
    const std::string kind = entry["kind"];
    body.kind = kind == "slide" ? Kind::Slide : kind == "universal" ? Kind::Universal : Kind::Hinge;
    body.parent = entry["parent"];
    body.index = out.size;
    out.size += body.kind == Kind::Universal ? 2 : 1;
    body.X_PJ.linear() = readMatrix(entry["R"]);
    body.X_PJ.translation() = readVector(entry["p"]);
    body.axis = readVector(entry["axis"]);
    body.axis2 = readVector(entry["axis2"]);
    body.mass = entry["mass"];
    body.com = readVector(entry["com"]);
    body.moments = readMatrix(entry["moments"]);
    out.bodies.push_back(body);
  }
  for (const json& entry : j["closures"]) {
    Closure closure;
    closure.body1 = entry["body1"];
    closure.body2 = entry["body2"];
    closure.point1 = readVector(entry["point1"]);
    closure.point2 = readVector(entry["point2"]);
    closure.is_hinge = entry.contains("axis");
    if (closure.is_hinge) closure.axis = readVector(entry["axis"]);
    out.closures.push_back(closure);
  }
  for (const json& entry : j["springs"])
    out.springs.push_back({entry["body1"], entry["body2"], readVector(entry["point1"]), readVector(entry["point2"]),
                           entry["stiffness"], entry["rest"], entry["preload"], entry["damping"]});
  return out;
}

// Of the steps of an engine with: Engine(mechanism), start(q, v), setForces(tau), step(h), q(), v().
template <typename Engine>
int serve() {
  std::ostream out(std::cout.rdbuf());
  std::cout.rdbuf(std::cerr.rdbuf());  // for what engines say
  try {
    std::string line;
    if (!std::getline(std::cin, line)) return 0;
    Engine engine(readMechanism(json::parse(line)));
    double cpu = 0;
    while (std::getline(std::cin, line)) {
      const json request = json::parse(line);
      if (request.contains("q")) {
        engine.start(readVector(request["q"]), readVector(request["v"]));
        cpu = 0;
      } else if (request.contains("forces")) {
        engine.setForces(readVector(request["forces"]));
      } else {
        const double h = request["step"], before = loops::readProcessorClock();
        for (double count = request["count"]; count > 0; --count) engine.step(h);
        cpu += loops::readProcessorClock() - before;
      }
      const VectorXd q = engine.q(), v = engine.v();
      if (q.allFinite() && v.allFinite())
        out << json{{"q", list(q)}, {"v", list(v)}, {"cpu", cpu}} << std::endl;
      else
        out << json{{"error", "the velocities are no longer finite"}} << std::endl;
    }
    return 0;
  } catch (const std::exception& error) {
    out << json{{"error", error.what()}} << std::endl;
    return 1;
  }
}

}  // namespace bielle::outside
