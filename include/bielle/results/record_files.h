#pragma once
/// \file Records of motions (motion/record.h) as files.
#include <string>

#include "bielle/motion/record.h"

namespace bielle {

/// One row per node under one header: time, q.<name>, v.<name>, a.<name>, u.<motor>, closure.<name>.<entry>,
/// contact.<name>.<entry>, com.x, com.y, com.z, gap.position, gap.angle and, of midpoint steps, q_mid.<name> and
/// v_mid.<name>. No stage starts at the last node: its cells of a, u, q_mid, v_mid and of the wrenches are empty.
/// Numbers are the shortest that read back to the same bits. Footholds and multipliers are left out. It is for other
/// programs; Bielle reads the archive below.
void writeCsv(const std::string& path, const MotionRecord& record);

/// NumPy archive of the members above by the same names; wrenches are N x closures x 6 and N x contacts x 6, footholds, if there
/// are any, N + 1 x contacts x 8. Multipliers, if known, are `multipliers` (node after node), `multiplier_rows` (N + 1, how many
/// each node has) and `multiplier_penalty` (1).
void writeNpz(const std::string& path, const MotionRecord& record);

/// Reads an archive that writeNpz() wrote.
/// \throws InputError naming the file and what is wrong with it, as the writers do when they cannot write
MotionRecord readRecord(const std::string& path);

/// What the two write.
std::string formatCsv(const MotionRecord& record);
std::string formatNpz(const MotionRecord& record);

/// The record in a directory written by writeResult().
/// \throws InputError naming the file and why it cannot be read
MotionRecord readResultRecord(const std::string& directory);

}  // namespace bielle
