#pragma once
/// \file What a program and a library share that were compiled for different processors.
#include <Eigen/Dense>
#include <memory>
#include <stdexcept>

/// The level of x86-64 that this very copy of the function was compiled for. Eigen's kernels are such functions.
template <typename T>
__attribute__((noipa)) int getLevelOutside(T) {
#if defined(__AVX512F__)
  return 4;
#elif defined(__AVX2__)
  return 3;
#else
  return 1;
#endif
}

namespace bielle {

template <typename T>
__attribute__((noipa)) int getLevel(T x) {
  return getLevelOutside(x);
}
__attribute__((noipa)) inline int getLevelInline() { return getLevelOutside(0); }

struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct Base {
  virtual ~Base();  // in the library, and with it the table and the type information of the class
};
struct Derived : Base {
  Eigen::Vector4d values = Eigen::Vector4d::Ones();  // its alignment is part of the layout
};
struct Layout {
  std::size_t vector4, matrix4, derived, allocated;
  bool operator==(const Layout& o) const {
    return vector4 == o.vector4 && matrix4 == o.matrix4 && derived == o.derived && allocated == o.allocated;
  }
};
inline Layout getLayoutInline() {
  return {alignof(Eigen::Vector4d), alignof(Eigen::Matrix4d), sizeof(Derived), EIGEN_DEFAULT_ALIGN_BYTES};
}

// Defined in the library.
int getLibraryLevel();      ///< of its copy of getLevel(0), if all others are of the same level, otherwise 0
Layout getLibraryLayout();  ///< getLayoutInline() as the library sees it
Eigen::MatrixXd multiply(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
void fail();                   ///< throws Failure
std::unique_ptr<Base> make();  ///< a Derived

}  // namespace bielle
