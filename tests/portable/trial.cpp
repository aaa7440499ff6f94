#include <bielle/trial.h>

namespace bielle {

int getLibraryLevel() {
  const int level = getLevel(0);
  return getLevelInline() == level && getLevelOutside(0) == level ? level : 0;
}
Base::~Base() = default;
Layout getLibraryLayout() { return getLayoutInline(); }
Eigen::MatrixXd multiply(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a * b; }
void fail() { throw Failure("in the library"); }
std::unique_ptr<Base> make() { return std::make_unique<Derived>(); }

}  // namespace bielle
