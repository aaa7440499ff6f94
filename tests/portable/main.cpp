// Prints the level of the library that was loaded, once all that crosses its border has been tried.
#include <bielle/trial.h>

#include <cstdio>

namespace {

int report(const char* problem) {
  std::fprintf(stderr, "%s\n", problem);
  return 1;
}
bool catchesFailure() {
  try {
    bielle::fail();
  } catch (const bielle::Failure&) {
    return true;
  } catch (...) {
  }
  return false;
}

}  // namespace

int main() {
  // The program's own copies, which must be neither the library's nor stand in for them.
  if (bielle::getLevel(0) != 1 || bielle::getLevelInline() != 1 || getLevelOutside(0) != 1)
    return report("the program calls functions of the library that it has itself");
  const int level = bielle::getLibraryLevel();
  if (level == 0) return report("the library calls functions of the program that it has itself");
  if (!(bielle::getLibraryLayout() == bielle::getLayoutInline())) return report("the layout of Eigen's types differs");
  if (!catchesFailure()) return report("an exception of the library is not known to the program");
  const std::unique_ptr<bielle::Base> base = bielle::make();
  const auto* derived = dynamic_cast<const bielle::Derived*>(base.get());
  if (!derived || derived->values != Eigen::Vector4d::Ones()) return report("a class of the library is not known");
  // Allocated there, used, enlarged and freed here.
  const Eigen::MatrixXd a = Eigen::MatrixXd::Random(37, 41), b = Eigen::MatrixXd::Random(41, 29);
  Eigen::MatrixXd product = bielle::multiply(a, b);
  if ((product - a * b).norm() > 1e-12) return report("products differ");
  product.conservativeResize(80, 80);
  std::printf("%d\n", level);
}
