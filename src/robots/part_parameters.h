#pragma once
/// \file Parameters of parts in parts.
#include "robots/part_file.h"

namespace bielle {

/// The entry of a tree that mounts a part.
struct PartMounting {
  const YamlEntry& entry;
  YamlFields fields;
  std::string prefix;  // of the parameters that it does not bind
  std::vector<std::pair<std::string, YamlEntry>> set;

  explicit PartMounting(const YamlEntry& entry);
  const YamlEntry* findSet(const std::string& parameter) const;
};

/// Whether an entry of a tree mounts a part; otherwise it is a link.
bool mountsPart(const YamlEntry& entry);

/// The files of which one is mounted: one, or those of all choices that are open. \param owner  the file of the entry
std::vector<const PartFile*> listAlternatives(PartLibrary& library, const PartFile& owner, const PartMounting& mounting,
                                              const PartChoices& chosen);

/// Choices of a mounted part that its mounting binds to a name.
PartChoices listBoundChoices(const PartFile& owner, const PartMounting& mounting, const PartChoices& chosen);

/// All parameters of a file that `chosen` leaves open, with those of parts in it; kept by the library.
/// \param depth  of the file in others
/// \throws InputError for parameters of one name that differ, and for parts that mount each other without end
const std::vector<PartParameter>& listParameters(PartLibrary& library, const PartFile& file, const PartChoices& chosen,
                                                 int depth = 0);

}  // namespace bielle
