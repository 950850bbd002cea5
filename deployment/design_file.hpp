// Designs as files: one of one's own from a family's parameters, or a preset with changes.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "stents/specification.hpp"

namespace vstent::deployment {

/// {"family": "rings", "crowns": 6, ...} or {"preset": "cp8", "rows": 8}: lengths are text with
/// their unit, keys those of stents/fields.hpp. What a file changes of a preset is documented as
/// the file's. \throws Error (usage) `<source>: /<key>: what is wrong`; a design that no stent can
/// have
stents::Specification parse_design(const nlohmann::json& json, const std::string& source);
stents::Specification read_design(const std::filesystem::path& path);

/// A preset's name, or the path of a design file (.json).
/// \throws Error (usage) also for an unknown name, which it compares with the known ones
stents::Specification find_design(const std::string& name_or_path);

/// Reads back as the same specification.
nlohmann::ordered_json to_json(const stents::Specification& specification);

}  // namespace vstent::deployment
