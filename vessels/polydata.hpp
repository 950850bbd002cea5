// VTK poly data in and out, guarded; included only by .cpp files that know VTK.
#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <filesystem>
#include <string>
#include <vector>

#include "vessels/surface.hpp"

namespace vstent::vessels {

/// Reads .vtp or legacy .vtk behind every guard: file checks, a child process, VTK's messages,
/// array validation. \throws Error (input_file)
vtkSmartPointer<vtkPolyData> read_polydata(const std::filesystem::path& path);

/// Empty, or the first thing wrong with the arrays: ids out of range, offsets that are not
/// monotone, non-finite points.
std::string polydata_fault(vtkPolyData* data);

/// The bytes of a .vtp file (appended raw, zlib); read back and compared with `data` before they
/// are returned. \throws Error (output) naming `name`
std::string vtp_bytes(vtkPolyData* data, const std::string& name);

/// Own strict readers; STL points are returned welded where their coordinates are equal.
/// \throws Error (input_file)
vtkSmartPointer<vtkPolyData> parse_stl(std::string_view bytes, const std::string& name,
                                       std::size_t& merged_points);
vtkSmartPointer<vtkPolyData> parse_obj(std::string_view bytes, const std::string& name,
                                       std::vector<Finding>& findings);

struct SourceData {
  vtkSmartPointer<vtkPolyData> data;
  std::vector<int> vertex_of_point;  ///< mesh vertex; -1 for points that no polygon uses
  std::vector<int> polygon_of_triangle;
  std::vector<char> polygon_turned;  ///< its corners are written in reverse order
};

}  // namespace vstent::vessels
