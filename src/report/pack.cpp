#include "report/pack.h"

#include <cmath>
#include <cstring>

namespace bielle {

std::string encodeBase64(const std::string& bytes) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (size_t j = 0; j < 3; ++j) group = group << 8 | (j < count ? static_cast<unsigned char>(bytes[i + j]) : 0u);
    for (size_t j = 0; j < 4; ++j) text += j <= count ? kDigits[group >> (18 - 6 * j) & 63] : '=';
  }
  return text;
}

Json packTable(const RowMatrixXd& table) {
  std::string bytes;
  bytes.reserve(4 * table.size());
  for (Eigen::Index i = 0; i < table.size(); ++i) {
    const auto value = static_cast<float>(table.data()[i]);
    std::uint32_t word;
    std::memcpy(&word, &value, sizeof word);
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 255);
  }
  return {{"rows", table.rows()}, {"cols", table.cols()}, {"data", encodeBase64(bytes)}};
}

PoseRow makePoseRow(const SE3& X) {
  PoseRow row;
  row << X.p.transpose(), Eigen::Quaterniond(X.R).coeffs().transpose();
  return row;
}

Json packPose(const SE3& X) { return packVector(makePoseRow(X)); }

Json packVector(const VectorXd& vector) { return std::vector<double>(vector.begin(), vector.end()); }

Json packNumber(double value) { return std::isfinite(value) ? Json(value) : Json(); }

}  // namespace bielle
