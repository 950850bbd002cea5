// Distrust of files: checked before a reader sees them, written whole or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace vstent::vessels {

/// The bytes of a regular, readable, non-empty file.
/// \throws Error (input_file)
std::string read_bytes(const std::filesystem::path& path);

/// Lower-case extension with its dot.
std::string extension(const std::filesystem::path& path);

/// Refuses what is no whole VTK XML PolyData file: another root type, several pieces, counts that
/// are no integers, that the file is too small for or that its arrays contradict, unknown
/// compressors, entities, a missing end. \throws Error (input_file)
void guard_vtp(std::string_view bytes, const std::string& name);

/// The same for the header and the geometry counts of a legacy .vtk PolyData file.
/// \throws Error (input_file)
void guard_legacy_vtk(std::string_view bytes, const std::string& name);

/// Runs `parse` in a child process with limits on memory, time and core dumps; `parse` returns an
/// empty string or what is wrong. Returns that, or how the child ended when it did not survive.
std::string try_in_child(const std::function<std::string()>& parse, std::size_t file_size);

/// Writes `<path>.partial-<pid>` beside `path`, reads it back, syncs it, renames it over `path`,
/// syncs the folder. Whatever fails, an older file at `path` stays as it was and nothing else is
/// left behind. \throws Error (output)
void write_whole(const std::filesystem::path& path, std::string_view bytes);

}  // namespace vstent::vessels
