#include "apps/figure.hpp"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>

#include <cmath>
#include <sstream>

#include "apps/drawing.hpp"

namespace vstent::apps {
namespace {

constexpr double kPixels = 2;  // per unit, in a PNG

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

std::string paint(const char* what, const Colour& c) {
  std::ostringstream text;
  text << what << "=\"rgb(" << c.red << ',' << c.green << ',' << c.blue << ")\"";
  if (c.opacity < 1) text << ' ' << what << "-opacity=\"" << c.opacity << '"';
  return text.str();
}

template <class Points>
std::string spots(const Points& points) {
  std::ostringstream text;
  for (const Spot& p : points) text << p.x << ',' << p.y << ' ';
  return text.str();
}

/// One cell, an open line or an area, as an actor without lighting.
template <class Points>
vtkNew<vtkActor> flat_actor(const Points& spots, bool area, const Colour& colour, double height,
                            double depth) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  cells->InsertNextCell(static_cast<int>(spots.size()));
  for (const Spot& p : spots)
    cells->InsertCellPoint(points->InsertNextPoint(p.x, height - p.y, depth));
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  if (area) {
    data->SetPolys(cells);
  } else {
    data->SetLines(cells);
  }
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(colour.red / 255.0, colour.green / 255.0, colour.blue / 255.0);
  actor->GetProperty()->SetOpacity(colour.opacity);
  actor->GetProperty()->LightingOff();
  return actor;
}

vtkNew<vtkTextActor> text_actor(const Caption& caption, double height) {
  vtkNew<vtkTextActor> actor;
  actor->SetInput(caption.text.c_str());
  vtkTextProperty* property = actor->GetTextProperty();
  property->SetFontSize(static_cast<int>(std::lround(kPixels * 0.92 * caption.size)));
  property->SetColor(0.12, 0.15, 0.2);
  property->SetVerticalJustificationToBottom();
  if (caption.anchor == Caption::Anchor::middle) property->SetJustificationToCentered();
  if (caption.anchor == Caption::Anchor::right) property->SetJustificationToRight();
  if (caption.upwards) property->SetOrientation(90);
  actor->SetPosition(kPixels * caption.at.x, kPixels * (height - caption.at.y));
  return actor;
}

}  // namespace

std::vector<Stroke> dashed(const Stroke& stroke, double dash, double gap) {
  std::vector<Stroke> pieces;
  double along = 0;  // within the period of a dash and a gap
  for (std::size_t i = 1; i < stroke.points.size(); ++i) {
    const Spot a = stroke.points[i - 1], b = stroke.points[i];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    for (double done = 0; done < length;) {
      const bool drawn = along < dash;
      const double piece = std::min(length - done, (drawn ? dash : dash + gap) - along);
      const auto at = [&](double s) {
        return Spot{a.x + (b.x - a.x) * s / length, a.y + (b.y - a.y) * s / length};
      };
      if (drawn) pieces.push_back({{at(done), at(done + piece)}, stroke.colour, stroke.width});
      done += std::max(piece, 1e-9);
      along += piece;
      if (along >= dash + gap - 1e-9) along = 0;
    }
  }
  return pieces;
}

std::string svg(const Figure& figure) {
  std::ostringstream text;
  text << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << figure.width << "\" height=\""
       << figure.height << "\" viewBox=\"0 0 " << figure.width << ' ' << figure.height
       << "\" font-family=\"Helvetica, Arial, sans-serif\" fill=\"none\" "
          "stroke-linejoin=\"round\">\n"
       << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (const Area& area : figure.areas)
    text << "<polygon points=\"" << spots(area.corners) << "\" " << paint("fill", area.colour)
         << "/>\n";
  for (const Stroke& s : figure.strokes) {
    text << "<polyline points=\"" << spots(s.points) << "\" " << paint("stroke", s.colour)
         << " stroke-width=\"" << s.width << "\"/>\n";
  }
  for (const Caption& c : figure.captions) {
    const char* const anchors[] = {"start", "middle", "end"};
    text << "<text x=\"" << c.at.x << "\" y=\"" << c.at.y << "\" font-size=\"" << c.size
         << "\" text-anchor=\"" << anchors[static_cast<int>(c.anchor)] << "\" fill=\"#1d2733\"";
    if (c.upwards) text << " transform=\"rotate(-90 " << c.at.x << ' ' << c.at.y << ")\"";
    text << '>' << escaped(c.text) << "</text>\n";
  }
  text << "</svg>\n";
  return text.str();
}

void write_png(const Figure& figure, const std::filesystem::path& path) {
  vtkNew<vtkRenderer> renderer;
  prepare(renderer);
  double depth = 0;
  for (const Area& area : figure.areas)
    renderer->AddActor(flat_actor(area.corners, true, area.colour, figure.height, depth += 1e-3));
  for (const Stroke& stroke : figure.strokes) {
    auto actor = flat_actor(stroke.points, false, stroke.colour, figure.height, depth += 1e-3);
    actor->GetProperty()->SetLineWidth(static_cast<float>(kPixels * stroke.width));
    renderer->AddActor(actor);
  }
  for (const Caption& caption : figure.captions)
    renderer->AddActor2D(text_actor(caption, figure.height));
  vtkCamera* camera = renderer->GetActiveCamera();
  camera->ParallelProjectionOn();
  camera->SetParallelScale(0.5 * figure.height);
  camera->SetFocalPoint(0.5 * figure.width, 0.5 * figure.height, 0);
  camera->SetPosition(0.5 * figure.width, 0.5 * figure.height, 1000);
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetSize(static_cast<int>(kPixels * figure.width),
                  static_cast<int>(kPixels * figure.height));
  window->SetMultiSamples(0);
  window->SetAlphaBitPlanes(1);
  window->AddRenderer(renderer);
  write_window(window, path);
}

}  // namespace vstent::apps
