#include "vessels/vtk_exchange.hpp"

#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationDoubleVectorKey.h>
#include <vtkInformationInformationVectorKey.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkPointSet.h>
#include <vtkPoints.h>
#include <vtkXMLWriter.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <new>

#include "vessels/error.hpp"

namespace vstent::vessels {

// VTK reports some faults to the reader's observers and some only to the global output window:
// listen to both.
class MessageWindow : public vtkOutputWindow {
 public:
  static MessageWindow* New();
  vtkTypeMacro(MessageWindow, vtkOutputWindow) void DisplayText(const char* text) override {
    add(text);
  }
  void DisplayErrorText(const char* text) override { add(text); }
  void DisplayWarningText(const char* text) override { add(text); }
  void DisplayGenericWarningText(const char* text) override { add(text); }
  void add(const char* text) {
    if (message.empty() && text != nullptr) message = text;
    if (message.empty()) message = "unnamed fault";
  }
  std::string message;  // the first one

 protected:
  MessageWindow() = default;
};
vtkStandardNewMacro(MessageWindow)

    Listening::Listening()
    : lock_(mutex()),
      previous_(vtkOutputWindow::GetInstance()),
      window_(vtkSmartPointer<MessageWindow>::New()) {
  vtkObject::GlobalWarningDisplayOn();
  vtkOutputWindow::SetInstance(window_);
  callback_->SetClientData(window_.GetPointer());
  callback_->SetCallback([](vtkObject*, unsigned long, void* window, void* text) {
    static_cast<MessageWindow*>(window)->add(static_cast<const char*>(text));
  });
}

Listening::~Listening() { vtkOutputWindow::SetInstance(previous_); }

void Listening::listen_to(vtkObject* object) {
  object->AddObserver(vtkCommand::ErrorEvent, callback_);
  object->AddObserver(vtkCommand::WarningEvent, callback_);
}

const std::string& Listening::message() const { return window_->message; }

std::mutex& Listening::mutex() {
  static std::mutex only;
  return only;
}

// VTK's messages are "ERROR: In file, line n\nvtkClass (0x...): what happened"; the last part is
// what a person needs.
std::string essence(const std::string& message) {
  std::string text = message;
  if (const auto line = text.find('\n'); line != std::string::npos && text.find("In ") < line) {
    text.erase(0, line + 1);
  }
  if (const auto object = text.find("): "); object != std::string::npos && object < 80)
    text.erase(0, object + 3);
  std::string flat;
  for (const char c : text) {
    const bool printable = std::isprint(static_cast<unsigned char>(c)) != 0;
    if (printable && c != ' ') flat += c;
    if ((!printable || c == ' ') && !flat.empty() && flat.back() != ' ') flat += ' ';
  }
  while (!flat.empty() && flat.back() == ' ') flat.pop_back();
  return flat.substr(0, 200);
}

namespace {

// Every array is left with an information object, empty or not: the writer marks arrays that have
// none differently.
void forget_ranges(vtkAbstractArray* array) {
  vtkInformation* information = array->GetInformation();
  information->Remove(vtkDataArray::L2_NORM_RANGE());
  information->Remove(vtkDataArray::L2_NORM_FINITE_RANGE());
  information->Remove(vtkAbstractArray::PER_COMPONENT());
  information->Remove(vtkAbstractArray::PER_FINITE_COMPONENT());
}

}  // namespace

void forget_ranges(vtkPointSet* data) {
  forget_ranges(data->GetPoints()->GetData());
  for (vtkFieldData* fields :
       {static_cast<vtkFieldData*>(data->GetPointData()),
        static_cast<vtkFieldData*>(data->GetCellData()), data->GetFieldData()}) {
    for (int a = 0; a < fields->GetNumberOfArrays(); ++a)
      forget_ranges(fields->GetAbstractArray(a));
  }
}

bool same_values(vtkAbstractArray* a, vtkAbstractArray* b) {
  if (a == nullptr || b == nullptr) return a == b;
  if (a->GetDataType() != b->GetDataType() || a->GetNumberOfValues() != b->GetNumberOfValues() ||
      a->GetNumberOfComponents() != b->GetNumberOfComponents()) {
    return false;
  }
  auto* numbers_a = vtkDataArray::SafeDownCast(a);
  auto* numbers_b = vtkDataArray::SafeDownCast(b);
  if (numbers_a == nullptr || numbers_b == nullptr || a->GetDataType() == VTK_BIT) return true;
  const auto bytes = static_cast<std::size_t>(a->GetNumberOfValues()) *
                     static_cast<std::size_t>(a->GetDataTypeSize());
  return bytes == 0 ||
         std::memcmp(numbers_a->GetVoidPointer(0), numbers_b->GetVoidPointer(0), bytes) == 0;
}

bool same_cells(vtkCellArray* a, vtkCellArray* b) {
  if (a->GetNumberOfCells() != b->GetNumberOfCells()) return false;
  vtkNew<vtkIdList> ids_a, ids_b;
  for (vtkIdType c = 0; c < a->GetNumberOfCells(); ++c) {
    a->GetCellAtId(c, ids_a);
    b->GetCellAtId(c, ids_b);
    if (ids_a->GetNumberOfIds() != ids_b->GetNumberOfIds()) return false;
    if (!std::equal(ids_a->begin(), ids_a->end(), ids_b->begin())) return false;
  }
  return true;
}

bool same_arrays(vtkFieldData* a, vtkFieldData* b) {
  if (a->GetNumberOfArrays() != b->GetNumberOfArrays()) return false;
  for (int i = 0; i < a->GetNumberOfArrays(); ++i) {
    if (!same_values(a->GetAbstractArray(i), b->GetAbstractArray(i))) return false;
  }
  return true;
}

std::string written_bytes(vtkXMLWriter* writer, const std::string& name) {
  try {
    Listening listening;
    listening.listen_to(writer);
    writer->WriteToOutputStringOn();
    writer->SetDataModeToAppended();
    writer->EncodeAppendedDataOff();
    writer->SetByteOrderToLittleEndian();
    const int written = writer->Write();
    if (written == 1 && writer->GetErrorCode() == 0 && listening.message().empty())
      return writer->GetOutputString();
    throw Error(ExitCode::output, name + ": could not be written, " +
                                      (listening.message().empty() ? "VTK's writer failed"
                                                                   : essence(listening.message())));
  } catch (const std::bad_alloc&) {
    throw Error(ExitCode::resources, name + ": could not be written, not enough memory");
  }
}

}  // namespace vstent::vessels
