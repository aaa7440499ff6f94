// In place of the reader of SDF files where libsdformat is not installed.
#include "bielle/model/error.h"
#include "formats/exchange_readers.h"

namespace bielle {

RobotFiles readSdf(const std::string& path) {
  throw InputError(path, "file", "SDF files are read by libsdformat, without which this program was built",
                   "install the package libsdformat-dev and build again, or give a URDF or a file of MuJoCo");
}

}  // namespace bielle
