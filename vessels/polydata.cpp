#include "vessels/polydata.hpp"

#include <SMP/Common/vtkSMPToolsAPI.h>  // vtkSMPTools.h itself is no C++20
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyDataReader.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <cmath>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/text.hpp"
#include "vessels/vtk_exchange.hpp"

namespace vstent::vessels {
namespace {

struct ReadOutcome {
  vtkSmartPointer<vtkPolyData> data;
  std::string fault;
};

template <class Reader, class Prepare>
ReadOutcome run_reader(Prepare&& prepare) {
  ReadOutcome outcome;
  try {
    Listening listening;
    vtkNew<Reader> reader;
    listening.listen_to(reader);
    prepare(*reader);
    reader->Update();
    outcome.data = reader->GetOutput();
    if (!listening.message().empty()) {
      outcome.fault = essence(listening.message());
    } else if (reader->GetErrorCode() != 0) {
      outcome.fault = "VTK error code " + std::to_string(reader->GetErrorCode());
    } else if (outcome.data == nullptr) {
      outcome.fault = "no poly data in it";
    }
  } catch (const std::bad_alloc&) {
    outcome.fault = "its counts ask for more memory than a file of this size can need";
  } catch (const std::exception& error) {
    outcome.fault = essence(error.what());
  }
  if (outcome.fault.empty()) outcome.fault = polydata_fault(outcome.data);
  return outcome;
}

ReadOutcome read_file(const std::filesystem::path& path, bool legacy) {
  const auto set_name = [&](auto& reader) { reader.SetFileName(path.c_str()); };
  if (!legacy) return run_reader<vtkXMLPolyDataReader>(set_name);
  return run_reader<vtkPolyDataReader>([&](vtkPolyDataReader& reader) {
    set_name(reader);
    reader.ReadAllScalarsOn();
    reader.ReadAllVectorsOn();
    reader.ReadAllNormalsOn();
    reader.ReadAllTensorsOn();
    reader.ReadAllTCoordsOn();
    reader.ReadAllFieldsOn();
    reader.ReadAllColorScalarsOn();
  });
}

std::string cells_fault(vtkCellArray* cells, vtkIdType points, const std::string& kind) {
  if (cells == nullptr) return {};
  const auto scan = [&](auto* offsets, auto* connectivity) -> std::string {
    const vtkIdType count = offsets->GetNumberOfValues();
    const vtkIdType ids = connectivity->GetNumberOfValues();
    if (offsets->GetNumberOfComponents() != 1 || connectivity->GetNumberOfComponents() != 1) {
      return kind + " arrays have more than one component";
    }
    if (count == 0) return ids == 0 ? std::string() : kind + " have ids but no offsets";
    if (offsets->GetValue(0) != 0) return kind + " offsets do not start at 0";
    for (vtkIdType i = 1; i < count; ++i) {
      if (offsets->GetValue(i) < offsets->GetValue(i - 1)) {
        return kind + " offsets fall at cell " + std::to_string(i - 1);
      }
    }
    if (offsets->GetValue(count - 1) != ids) {
      return kind + " offsets end at " + std::to_string(offsets->GetValue(count - 1)) +
             " but there are " + std::to_string(ids) + " ids";
    }
    for (vtkIdType i = 0; i < ids; ++i) {
      const auto id = connectivity->GetValue(i);
      if (id < 0 || id >= points) {
        return kind + " name point " + std::to_string(id) + ", points are 0 to " +
               std::to_string(points - 1);
      }
    }
    return {};
  };
  return cells->IsStorage64Bit()
             ? scan(cells->GetOffsetsArray64(), cells->GetConnectivityArray64())
             : scan(cells->GetOffsetsArray32(), cells->GetConnectivityArray32());
}

std::string attributes_fault(vtkFieldData* attributes, vtkIdType tuples, const std::string& kind) {
  for (int a = 0; a < attributes->GetNumberOfArrays(); ++a) {
    vtkAbstractArray* array = attributes->GetAbstractArray(a);
    if (array->GetNumberOfTuples() == tuples) continue;
    return kind + " array " + (array->GetName() != nullptr ? array->GetName() : "(unnamed)") +
           " has " + std::to_string(array->GetNumberOfTuples()) + " values for " +
           std::to_string(tuples);
  }
  return {};
}

}  // namespace

std::string polydata_fault(vtkPolyData* data) {
  vtkPoints* points = data->GetPoints();
  if (points == nullptr || points->GetNumberOfPoints() == 0) return "it has no points";
  const vtkIdType count = points->GetNumberOfPoints();
  const int type = points->GetDataType();
  if (type != VTK_FLOAT && type != VTK_DOUBLE) {
    return std::string("its points are of type ") + points->GetData()->GetDataTypeAsString() +
           ", use float or double";
  }
  if (points->GetData()->GetNumberOfComponents() != 3)
    return "its points do not have 3 coordinates";
  std::size_t faulty = 0;
  std::string first;
  for (vtkIdType p = 0; p < count; ++p) {
    double x[3];
    points->GetPoint(p, x);
    const bool finite = std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]);
    const bool bounded = std::abs(x[0]) < 1e30 && std::abs(x[1]) < 1e30 && std::abs(x[2]) < 1e30;
    if (finite && bounded) continue;
    if (faulty++ == 0) {
      first = "point " + std::to_string(p) + " is " + place(Vec3(x)) +
              (finite ? ", beyond any length" : ", not a finite position");
    }
  }
  if (faulty > 0)
    return first + (faulty > 1 ? " (and " + counted(faulty - 1, "more point") + ")" : "");

  const std::pair<vtkCellArray*, const char*> kinds[] = {{data->GetVerts(), "vertex cells"},
                                                         {data->GetLines(), "lines"},
                                                         {data->GetPolys(), "polygons"},
                                                         {data->GetStrips(), "strips"}};
  vtkIdType cells = 0;
  for (const auto& [array, kind] : kinds) {
    if (std::string fault = cells_fault(array, count, kind); !fault.empty()) return fault;
    if (array != nullptr) cells += array->GetNumberOfCells();
  }
  if (std::string fault = attributes_fault(data->GetPointData(), count, "point"); !fault.empty())
    return fault;
  return attributes_fault(data->GetCellData(), cells, "cell");
}

vtkSmartPointer<vtkPolyData> read_polydata(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  const bool legacy = extension(path) == ".vtk";
  if (legacy) {
    guard_legacy_vtk(bytes, path.string());
  } else {
    guard_vtp(bytes, path.string());
  }
  const std::string fault = try_in_child(
      [&] {
        vtk::detail::smp::vtkSMPToolsAPI::GetInstance().SetBackend(
            "Sequential");  // threads do not survive a fork
        return read_file(path, legacy).fault;
      },
      bytes.size());
  if (!fault.empty()) throw Error(ExitCode::input_file, path.string() + ": damaged, " + fault);
  ReadOutcome outcome = read_file(path, legacy);
  if (!outcome.fault.empty())
    throw Error(ExitCode::input_file, path.string() + ": damaged, " + outcome.fault);
  return outcome.data;
}

namespace {

bool same_data(vtkPolyData* a, vtkPolyData* b) {
  return same_values(a->GetPoints()->GetData(), b->GetPoints()->GetData()) &&
         same_cells(a->GetVerts(), b->GetVerts()) && same_cells(a->GetLines(), b->GetLines()) &&
         same_cells(a->GetPolys(), b->GetPolys()) &&
         same_arrays(a->GetPointData(), b->GetPointData()) &&
         same_arrays(a->GetCellData(), b->GetCellData()) &&
         same_arrays(a->GetFieldData(), b->GetFieldData());
}

}  // namespace

std::string vtp_bytes(vtkPolyData* original, const std::string& name) {
  // The writer caches value ranges in the arrays and then writes them: a copy without them gives
  // the same bytes each time.
  vtkNew<vtkPolyData> data;
  data->DeepCopy(original);
  forget_ranges(data);
  const auto failure = [&](const std::string& why) {
    return Error(ExitCode::output, name + ": could not be written, " + why);
  };
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(data);
  const std::string bytes = written_bytes(writer, name);
  const ReadOutcome back = run_reader<vtkXMLPolyDataReader>([&](vtkXMLPolyDataReader& reader) {
    reader.ReadFromInputStringOn();
    reader.SetInputString(bytes);
  });
  if (!back.fault.empty()) throw failure("reading it back failed: " + back.fault);
  if (!same_data(data, back.data))
    throw failure("what was read back differs from what was written");
  return bytes;
}

}  // namespace vstent::vessels
