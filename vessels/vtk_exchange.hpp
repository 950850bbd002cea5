// What readers and writers of VTK share: their messages heard, arrays compared bit by bit; included
// only by .cpp files that know VTK.
#pragma once

#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <mutex>
#include <string>

class vtkCallbackCommand;
class vtkCellArray;
class vtkFieldData;
class vtkAbstractArray;
class vtkObject;
class vtkOutputWindow;
class vtkPointSet;
class vtkXMLWriter;

namespace vstent::vessels {

class MessageWindow;

/// While it lives, VTK's messages are kept instead of printed; one at a time in a process.
class Listening {
 public:
  Listening();
  ~Listening();
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

  void listen_to(vtkObject* object);
  const std::string& message() const;  ///< the first one, or empty

 private:
  static std::mutex& mutex();
  std::lock_guard<std::mutex> lock_;
  vtkSmartPointer<vtkOutputWindow> previous_;
  vtkSmartPointer<MessageWindow> window_;
  vtkNew<vtkCallbackCommand> callback_;
};

/// The part of one of VTK's messages that a person needs.
std::string essence(const std::string& message);

/// Value ranges that writers cache in arrays and then write; without them the same data give the
/// same bytes each time.
void forget_ranges(vtkPointSet* data);

bool same_values(vtkAbstractArray* a, vtkAbstractArray* b);
bool same_cells(vtkCellArray* a, vtkCellArray* b);
bool same_arrays(vtkFieldData* a, vtkFieldData* b);

/// What `writer` makes of its input: appended, raw, zlib. \throws Error (output, resources) naming
/// `name`
std::string written_bytes(vtkXMLWriter* writer, const std::string& name);

}  // namespace vstent::vessels
