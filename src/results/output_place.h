#pragma once
// Where results may go.
#include <string>
#include <vector>

namespace bielle {

// \throws InputError when a file or directory that is to be written is one of those that are read, by whatever path: what was
// read would be lost
void requireApart(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace bielle
