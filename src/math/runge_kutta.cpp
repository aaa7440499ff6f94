#include "math/runge_kutta.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bielle {
namespace {

constexpr int kStages = RungeKutta::kStages;

// Row i: the weights of the rates before it in stage i + 1.
constexpr double kA[kStages - 1][kStages - 1] = {
    {0.05260015195876773},
    {0.0197250569845379, 0.0591751709536137},
    {0.02958758547680685, 0, 0.08876275643042054},
    {0.2413651341592667, 0, -0.8845494793282861, 0.924834003261792},
    {0.037037037037037035, 0, 0, 0.17082860872947386, 0.12546768756682242},
    {0.037109375, 0, 0, 0.17025221101954405, 0.06021653898045596, -0.017578125},
    {0.03709200011850479, 0, 0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402, 0.008273789163814023},
    {0.6241109587160757, 0, 0, -3.3608926294469414, -0.868219346841726, 27.59209969944671, 20.154067550477894,
     -43.48988418106996},
    {0.47766253643826434, 0, 0, -2.4881146199716677, -0.590290826836843, 21.230051448181193, 15.279233632882423,
     -33.28821096898486, -0.020331201708508627},
    {-0.9371424300859873, 0, 0, 5.186372428844064, 1.0914373489967295, -8.149787010746927, -18.52006565999696,
     22.739487099350505, 2.4936055526796523, -3.0467644718982196},
    {2.273310147516538, 0, 0, -10.53449546673725, -2.0008720582248625, -17.9589318631188, 27.94888452941996,
     -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636},
};
constexpr double kB[kStages] = {0.054293734116568765,
                                0,
                                0,
                                0,
                                0,
                                4.450312892752409,
                                1.8915178993145003,
                                -5.801203960010585,
                                0.3111643669578199,
                                -0.1521609496625161,
                                0.20136540080403034,
                                0.04471061572777259};
// Weights of the errors of orders 5 and 3.
constexpr double kE5[kStages] = {0.01312004499419488,
                                 0,
                                 0,
                                 0,
                                 0,
                                 -1.2251564463762044,
                                 -0.4957589496572502,
                                 1.6643771824549864,
                                 -0.35032884874997366,
                                 0.3341791187130175,
                                 0.08192320648511571,
                                 -0.022355307863886294};
constexpr double kE3[kStages] = {-0.18980075407240762,
                                 0,
                                 0,
                                 0,
                                 0,
                                 4.450312892752409,
                                 1.8915178993145003,
                                 -5.801203960010585,
                                 -0.4226823213237919,
                                 -0.1521609496625161,
                                 0.20136540080403034,
                                 0.02265179219836082};

}  // namespace

RungeKutta::RungeKutta(Eigen::Index size) {
  for (VectorXd& k : k_) k.setZero(size);
  stage_.setZero(size);
  end_.setZero(size);
}

double RungeKutta::step(const Derivative& f, const VectorXd& x0, const VectorXd& rate, double h, ConstVectorRef scale) {
  k_[0] = rate;
  for (int i = 1; i < kStages; ++i) {
    stage_ = x0;
    for (int j = 0; j < i; ++j)
      if (kA[i - 1][j] != 0) stage_ += h * kA[i - 1][j] * k_[j];
    if (!f(stage_, k_[i])) return std::numeric_limits<double>::infinity();
  }
  end_ = x0;
  for (int i = 0; i < kStages; ++i)
    if (kB[i] != 0) end_ += h * kB[i] * k_[i];

  double fifth = 0, third = 0;
  for (Eigen::Index n = 0; n < scale.size(); ++n) {
    double e5 = 0, e3 = 0;
    for (int i = 0; i < kStages; ++i) {
      e5 += kE5[i] * k_[i][n];
      e3 += kE3[i] * k_[i][n];
    }
    fifth += e5 * e5 / (scale[n] * scale[n]);
    third += e3 * e3 / (scale[n] * scale[n]);
  }
  if (fifth == 0) return 0;
  const double error = h * fifth / std::sqrt((fifth + 0.01 * third) * static_cast<double>(scale.size()));
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

double RungeKutta::calcFactor(double error) {
  constexpr double kSafety = 0.9, kLeast = 0.2, kMost = 6;
  if (error == 0) return kMost;
  return std::clamp(kSafety * std::pow(error, -1.0 / kOrder), kLeast, kMost);
}

}  // namespace bielle
