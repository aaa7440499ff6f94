#include "math/decompositions.h"

namespace Eigen {

BIELLE_DENSE_PLAIN()

}  // namespace Eigen
