#pragma once
/// \file The modes of a robot as a page: one at a time, chosen from a list, as it swings with an amplitude set by a slider.
///
/// A mode (modes.h) moves as q = q_0 (+) a Re(shape e^{i p}). The page lets the phase p run evenly, one turn in two seconds
/// whatever the frequency, and without decay. The postures are precomputed, up to 0.2 rad or m of the coordinate that moves
/// most: what the shape gives, to first order, with its loops closed and the feet that stand put back.
#include <vector>

#include "bielle/dynamics/modes.h"
#include "bielle/formats/reader.h"

namespace bielle {

/// \param contacts  those that stand still
/// \throws InputError when there is no mode
std::string makeModeView(const LoadedRobot& robot, ConstVectorRef q, const std::vector<int>& contacts,
                         const std::vector<Mode>& modes);

/// Writes the page to a temporary file and renames it. \throws InputError as above, or when it cannot be written
void writeModeView(const std::string& path, const LoadedRobot& robot, ConstVectorRef q,
                   const std::vector<int>& contacts, const std::vector<Mode>& modes);

}  // namespace bielle
