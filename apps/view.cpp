// vstent view: a result folder in a window of its own.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkInteractorStyle.h>
#include <vtkObjectFactory.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRendererCollection.h>
#include <vtkTextActor.h>

#include <csignal>
#include <cstdlib>
#include <memory>

#include "apps/commands.hpp"
#include "apps/drawing.hpp"
#include "apps/result_view.hpp"
#include "apps/terminal.hpp"
#include "vessels/error.hpp"

namespace vstent::apps {
namespace {

struct Arguments {
  std::string folder;
  ThreadLimit threads;
};

/// VTK ends the process where the X server cannot be reached, so a child tries first.
bool window_opens() {
  const pid_t child = fork();
  if (child == 0) {
    const int nothing = open("/dev/null", O_RDWR);
    dup2(nothing, STDOUT_FILENO);
    dup2(nothing, STDERR_FILENO);
    vtkNew<vtkRenderWindow> window;
    window->SetSize(1, 1);
    window->SetShowWindow(false);
    window->Render();
    _exit(0);
  }
  int status = 0;
  return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

void require_display() {
  const char* const instead = "; `vstent report` makes a page for any browser";
  const char* display = std::getenv("DISPLAY");
  if (display == nullptr || *display == '\0')
    throw Error(ExitCode::output, std::string("no display: DISPLAY is not set") + instead);
  if (!window_opens()) {
    throw Error(ExitCode::output,
                std::string("no display: no window opens on DISPLAY=") + display + instead);
  }
}

/// Left drag turns, right drag moves, the wheel zooms. (VTK's own styles need MPI to link.)
class Turning : public vtkInteractorStyle {
 public:
  static Turning* New();
  vtkTypeMacro(Turning, vtkInteractorStyle)

      void OnLeftButtonDown() override {
    State = VTKIS_ROTATE;
  }
  void OnLeftButtonUp() override { State = VTKIS_NONE; }
  void OnRightButtonDown() override { State = VTKIS_PAN; }
  void OnRightButtonUp() override { State = VTKIS_NONE; }
  void OnMouseWheelForward() override { zoom(1.1); }
  void OnMouseWheelBackward() override { zoom(1 / 1.1); }

  void OnMouseMove() override {
    if (State == VTKIS_NONE) return;
    const int* now = Interactor->GetEventPosition();
    const int* before = Interactor->GetLastEventPosition();
    const double right = now[0] - before[0];
    const double upwards = now[1] - before[1];
    const int* size = Interactor->GetSize();
    vtkCamera* const seen = camera();
    if (State == VTKIS_ROTATE) {
      seen->Azimuth(-180 * right / size[0]);
      seen->Elevation(-180 * upwards / size[1]);
      seen->OrthogonalizeViewUp();
    } else {
      const double per_pixel = 2 * seen->GetParallelScale() / size[1];
      const Vec3 direction(seen->GetDirectionOfProjection());
      const Vec3 up(seen->GetViewUp());
      const Vec3 shift = -per_pixel * (right * direction.cross(up) + upwards * up);
      const Vec3 focus = Vec3(seen->GetFocalPoint()) + shift;
      const Vec3 eye = Vec3(seen->GetPosition()) + shift;
      seen->SetFocalPoint(focus.data());
      seen->SetPosition(eye.data());
    }
    draw();
  }

 protected:
  Turning() = default;

 private:
  vtkRenderer* renderer() {
    return Interactor->GetRenderWindow()->GetRenderers()->GetFirstRenderer();
  }
  vtkCamera* camera() { return renderer()->GetActiveCamera(); }
  void zoom(double factor) {
    camera()->Zoom(factor);
    draw();
  }
  void draw() {
    renderer()->ResetCameraClippingRange();
    Interactor->Render();
  }
};
vtkStandardNewMacro(Turning)

    struct Stage {
  std::string name;
  vtkNew<vtkActor> wall, stent;
};

/// What the keys change.
struct Show {
  std::vector<std::unique_ptr<Stage>> stages;
  std::size_t current = 0;
  bool with_stent = true;
  vtkNew<vtkTextActor> title;
  vtkRenderWindow* window = nullptr;

  void update() {
    for (std::size_t s = 0; s < stages.size(); ++s) {
      stages[s]->wall->SetVisibility(s == current);
      stages[s]->stent->SetVisibility(s == current && with_stent);
    }
    title->SetInput(stages[current]->name.c_str());
    window->Render();
  }

  void key(const std::string& name) {
    if (name == "Left" && current > 0) --current;
    if (name == "Right" && current + 1 < stages.size()) ++current;
    if (name == "space") with_stent = !with_stent;
    update();
  }
};

void run(const Arguments& a) {
  a.threads.apply();
  const report::ResultFiles files = report::read_result(a.folder);
  require_display();
  const View view = view_of(files);
  vtkNew<vtkRenderer> renderer;
  prepare(renderer);
  Show show;
  const auto add = [&](const std::string& name, const TriangleMesh& wall,
                       const TriangleMesh& stent) {
    Stage& stage = *show.stages.emplace_back(
        new Stage{name, actor_for(wall, kWallLook), actor_for(stent, kStentLook)});
    renderer->AddActor(stage.wall);
    renderer->AddActor(stage.stent);
  };
  add("before", {files.before, files.after.triangles}, {});
  for (const report::SavedStep& step : files.steps) {
    add("step " + std::to_string(step.step), vessels::read_surface(step.wall, files.unit).mesh,
        vessels::read_surface(step.stent, files.unit).mesh);
  }
  add("after", files.after, files.stent);
  show.current = show.stages.size() - 1;

  label(renderer, "arrow keys: stages   space: stent   r: whole vessel   q: end", 16, 16, 16);
  label(renderer, kDisclaimer, 16, 40, 16);
  caption(show.title, 16, 740, 26);
  renderer->AddActor2D(show.title);
  vtkNew<vtkRenderWindow> window;
  window->SetSize(1000, 800);
  window->SetWindowName(("vstent: " + a.folder).c_str());
  window->SetMultiSamples(0);
  window->SetAlphaBitPlanes(1);
  window->AddRenderer(renderer);
  aim(renderer, view);
  renderer->ResetCameraClippingRange();
  // Its constructor asks for the styles that are not linked; `style` takes their place.
  vtkObject::GlobalWarningDisplayOff();
  vtkNew<vtkRenderWindowInteractor> interactor;
  vtkObject::GlobalWarningDisplayOn();
  interactor->SetRenderWindow(window);
  vtkNew<Turning> style;
  interactor->SetInteractorStyle(style);
  vtkNew<vtkCallbackCommand> keys;
  keys->SetClientData(&show);
  keys->SetCallback([](vtkObject* caller, unsigned long, void* data, void*) {
    static_cast<Show*>(data)->key(static_cast<vtkRenderWindowInteractor*>(caller)->GetKeySym());
  });
  interactor->AddObserver(vtkCommand::KeyPressEvent, keys);
  show.window = window;
  show.update();
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
  interactor->Start();
}

}  // namespace

void add_view(CLI::App& app) {
  auto* command = app.add_subcommand("view", "A result folder in a window");
  auto a = std::make_shared<Arguments>();
  command->add_option("folder", a->folder, "A folder that `vstent deploy` wrote")->required();
  a->threads.add_option(*command);
  command->footer("Example:\n  vstent view OUT");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
