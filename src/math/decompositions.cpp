#include "math/decompositions.h"

namespace Eigen {

BIELLE_DENSE()

}  // namespace Eigen
