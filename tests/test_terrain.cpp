// The ground of a world: lookups agree with Ground, normals with its slopes, sides of boxes push outwards.
#include <catch2/catch.hpp>
#include <random>

#include "bielle/model/error.h"
#include "worlds/made_ground.h"
#include "worlds/terrain.h"

namespace bielle::worlds {
namespace {

Ground makeMixedGround() {
  Ground ground = makeTiles({0.02, 0.3, -1, 3, 2, 7});
  ground.height = -0.1;
  ground.steps.push_back({{0.4, 0.1, 0.15}, 0.5, 0.3, 0.7, 0.1, -0.2});
  ground.steps.push_back({{-3, 2, 0.3}, 2, 1, -1.2, 0, 0});
  return ground;
}

}  // namespace

TEST_CASE("terrain: lookups by cells find the heights of all boxes") {
  const Ground ground = makeMixedGround();
  const Terrain terrain(ground);
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> anywhere(-6, 6);
  int boxes = 0;
  for (int i = 0; i < 20000; ++i) {
    const double x = anywhere(generator), y = anywhere(generator);
    const double height = ground.calcHeight(x, y);
    REQUIRE(terrain.find(x, y).height == Approx(height).margin(1e-12));
    boxes += height > ground.height;
  }
  CHECK(boxes > 500);
}

TEST_CASE("terrain: normals are those of the tops") {
  const Terrain terrain(makeMixedGround());
  const double x = 0.42, y = 0.12, h = 1e-5;
  const auto height = [&](double dx, double dy) { return terrain.find(x + dx, y + dy).height; };
  const Vector3d expected = Vector3d(height(-h, 0) - height(h, 0), height(0, -h) - height(0, h), 2 * h).normalized();
  CHECK((terrain.find(x, y).normal - expected).norm() < 1e-9);
  CHECK(expected.z() < 0.99);
}

TEST_CASE("terrain: a point leaves a box by the shortest way, but not into the ground") {
  Ground ground;
  ground.steps.push_back({{0.5, 0, 0.1}, 1, 1, 0, 0, 0});
  ground.steps.push_back({{1.5, 0, 0.1}, 1, 1, 0, 0, 0});
  const Terrain terrain(ground);
  const Terrain::Touch above = terrain.touch({0.5, 0, 0.103}), top = terrain.touch({0.5, 0, 0.09});
  CHECK(above.depth == Approx(-0.003));
  CHECK(top.depth == Approx(0.01));
  CHECK(top.normal.z() == 1);
  const Terrain::Touch side = terrain.touch({0.004, 0.1, 0.05});
  CHECK(side.depth == Approx(0.004));
  CHECK((side.normal + Vector3d::UnitX()).norm() < 1e-12);
  CHECK(terrain.touch({0.999, 0.1, 0.05}).normal.z() == 1);  // the next box is beyond this side
  CHECK(terrain.touch({-0.2, 0, -0.01}).depth == Approx(0.01));
  // In the corner of ground and side, both push.
  const Terrain::Touch corner = terrain.touch({0.004, 0.1, -0.003});
  CHECK(corner.depth == Approx(0.005));
  CHECK((corner.normal - Vector3d(-0.8, 0, 0.6)).norm() < 1e-12);
  // One that came from above leaves through the top, however near the side is.
  CHECK(terrain.touch({0.004, 0.1, 0.05}, {-0.01, 0.1, 0.101}).depth == Approx(0.05));
  CHECK(terrain.touch({0.004, 0.1, 0.05}, {-0.01, 0.1, 0.099}).depth == Approx(0.004));
}

TEST_CASE("terrain: a sole rests with its own points within one step and in the air, else on edges") {
  const Terrain terrain(makeMixedGround());
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> anywhere(-1.5, 1.5), height(-0.05, 0.05), slope(-0.1, 0.1);
  int moved = 0, kept = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector2d middle(anywhere(generator), anywhere(generator));
    const Terrain::Corners corners = {middle + Eigen::Vector2d(0.1, 0.05), middle + Eigen::Vector2d(-0.1, 0.05),
                                      middle + Eigen::Vector2d(-0.1, -0.05), middle + Eigen::Vector2d(0.1, -0.05)};
    Vector3d plane(0, slope(generator), slope(generator));
    plane[0] = terrain.find(middle.x(), middle.y()).height + height(generator) - plane.tail<2>().dot(middle);
    std::vector<Terrain::Place> places;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        places.push_back({middle + Eigen::Vector2d(0.1 * x, 0.05 * y), Eigen::Vector2d::Zero()});
    terrain.findSupports(corners, plane, 2e-4, 5e-3, places);
    for (const Terrain::Place& place : places) {
      const Eigen::Vector2d& at = place.support;
      CHECK(((at - middle).cwiseAbs() - Eigen::Vector2d(0.1, 0.05)).maxCoeff() < 1e-9);
      if (at == place.home) {
        ++kept;
        continue;
      }
      ++moved;  // to the ground, where its own place is above it
      const double gap = plane[0] + plane.tail<2>().dot(at) - terrain.find(at.x(), at.y()).height;
      CHECK(gap <= 2e-4 + 1e-12);
      CHECK(gap >= -5e-3 - 1e-12);
    }
  }
  CHECK(moved > 100);
  CHECK(kept > 10000);
}

TEST_CASE("terrain: where a sole rests does not depend on the cells in which a step is looked up") {
  Ground ground;
  ground.steps.push_back({{0, 0, 0.1}, 2, 0.018});  // what of a sole lies on it may have six corners, or eight
  const Terrain coarse(ground);
  for (int i = 0; i < 30; ++i) ground.steps.push_back({{0.05 * i - 0.75, 0.5, 0.1}, 0.02, 0.02});
  const Terrain fine(ground);
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> anywhere(-0.02, 0.02), along(-0.7, 0.7), angle(-0.4, 0.4);
  int added = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d middle(along(generator), anywhere(generator));
    const Eigen::Matrix2d R = Eigen::Rotation2Dd(angle(generator)).toRotationMatrix();
    const auto at = [&](double x, double y) -> Eigen::Vector2d {
      return middle + R * Eigen::Vector2d(0.1 * x, 0.02 * y);
    };
    const Terrain::Corners corners = {at(1, 1), at(-1, 1), at(-1, -1), at(1, -1)};
    std::vector<Terrain::Place> places;
    for (double x = -1; x <= 1; x += 0.5)
      for (double y = -1; y <= 1; y += 0.5) {
        places.push_back({at(x, y), Eigen::Vector2d::Zero()});
        places.back().is_corner = std::abs(x * y) == 1;
      }
    std::vector<Terrain::Place> same = places;
    coarse.findSupports(corners, Vector3d(0.1, 0, 0), 2e-4, 5e-3, places);
    fine.findSupports(corners, Vector3d(0.1, 0, 0), 2e-4, 5e-3, same);
    for (size_t k = 0; k < places.size(); ++k) {
      REQUIRE(same[k].support == places[k].support);
      REQUIRE(same[k].takes_corner == places[k].takes_corner);
      added += places[k].takes_corner && !places[k].is_corner;
    }
  }
  CHECK(added > 50);
}

TEST_CASE("terrain: ramps start level, up and down") {
  for (double slope : {0.1, -0.1}) {
    const Terrain terrain(makeRamp({slope, 0.3, 5, 4}));
    CHECK(terrain.find(0, 0).height == Approx(0).margin(1e-12));
    CHECK(terrain.find(0.29, 0).height == Approx(0).margin(1e-12));
    CHECK(terrain.find(2.3, 0.5).height == Approx(2 * slope));
    CHECK(terrain.find(2.3, 0.5).normal.x() == Approx(-slope / std::hypot(1, slope)));
  }
}

TEST_CASE("terrain: tiles are of the requested heights, and the same for the same seed") {
  const TileOptions options{0.03, 0.25, 0.2, 10, 4, 5};
  const Ground ground = makeTiles(options), again = makeTiles(options);
  double lowest = 1, highest = 0;
  for (size_t i = 0; i < ground.steps.size(); ++i) {
    REQUIRE(ground.steps[i].top == again.steps[i].top);
    lowest = std::min(lowest, ground.steps[i].top.z());
    highest = std::max(highest, ground.steps[i].top.z());
  }
  CHECK(lowest >= 0);
  CHECK(lowest < 0.002);
  CHECK(highest <= 0.03);
  CHECK(highest > 0.028);
  CHECK(ground.calcHeight(0.19, 0) == 0);
  TileOptions below = options;
  below.lowest = -0.03;
  const Terrain uneven(makeTiles(below));
  for (size_t i = 0; i < ground.steps.size(); ++i) {
    const Vector3d& top = ground.steps[i].top;
    CHECK(uneven.find(top.x(), top.y()).height == Approx(2 * top.z() - 0.03));
  }
  CHECK(uneven.find(0.19, 0).height == 0);
  CHECK(uneven.find(11, 0).height == -0.03);
  TileOptions other = options;
  other.seed = 6;
  CHECK(makeTiles(other).steps[0].top != ground.steps[0].top);
  other.size = 0;
  CHECK_THROWS_AS(makeTiles(other), InputError);
}

}  // namespace bielle::worlds
