#include <gtest/gtest.h>

#include <csignal>
#include <random>

#include "tests/data.hpp"
#include "tests/vessels/shapes.hpp"
#include "tests/vessels/surface_files.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/polydata.hpp"
#include "vessels/surface.hpp"
#include "vessels/triangulate.hpp"

namespace vstent::vessels {
namespace {

using tests::binary_stl;
using tests::found;
using tests::none_moved;
using tests::obj_text;
using tests::refusal;
using tests::replaced;
using tests::rich_tube;
using tests::TemporaryFolder;
using tests::tube;
using tests::vtp_text;
using tests::written;

double volume(const TriangleMesh& mesh) {  // against the origin, open ends left open
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.points[static_cast<std::size_t>(t[0])],
               &b = mesh.points[static_cast<std::size_t>(t[1])],
               &c = mesh.points[static_cast<std::size_t>(t[2])];
    sum += a.x() * (b.y() * c.z() - b.z() * c.y()) + a.y() * (b.z() * c.x() - b.x() * c.z()) +
           a.z() * (b.x() * c.y() - b.y() * c.x());
  }
  return sum / 6;
}

TEST(ReadSurface, EveryFormatAndEncodingGivesTheSameMesh) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tube(2.5, 20, 16, 11);
  for (Vec3& x : mesh.points) x = x.cast<float>().cast<double>();
  vtkSmartPointer<vtkPolyData> data = rich_tube(mesh);
  using Xml = vtkXMLPolyDataWriter;
  using Legacy = vtkPolyDataWriter;
  const std::pair<const char*, std::string> files[] = {
      {"ascii.vtp", vtp_text(mesh)},
      {"vtkascii.vtp", written<Xml>(data, [](Xml& w) { w.SetDataModeToAscii(); })},
      {"binary.vtp", written<Xml>(data, [](Xml& w) { w.SetDataModeToBinary(); })},
      {"raw.vtp",
       written<Xml>(data, [](Xml& w) { w.SetDataModeToAppended(), w.EncodeAppendedDataOff(); })},
      {"base64.vtp",
       written<Xml>(data, [](Xml& w) { w.SetDataModeToAppended(), w.EncodeAppendedDataOn(); })},
      {"plain.vtp",
       written<Xml>(data, [](Xml& w) { w.SetCompressorTypeToNone(), w.SetHeaderTypeToUInt64(); })},
      {"lz4.vtp", written<Xml>(data, [](Xml& w) { w.SetCompressorTypeToLZ4(); })},
      {"lzma.vtp", written<Xml>(data, [](Xml& w) { w.SetCompressorTypeToLZMA(); })},
      {"big.vtp", written<Xml>(data, [](Xml& w) { w.SetByteOrderToBigEndian(); })},
      {"42ascii.vtk", written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(42); })},
      {"42.vtk",
       written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(42), w.SetFileTypeToBinary(); })},
      {"51ascii.vtk", written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(51); })},
      {"51.vtk",
       written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(51), w.SetFileTypeToBinary(); })},
      {"tube.OBJ", obj_text(mesh)},
      {"tube.stl", binary_stl(mesh)},
  };
  for (const auto& [name, bytes] : files) {
    const Surface surface = read_surface(folder.write(name, bytes), LengthUnit::mm);
    EXPECT_EQ(found(surface, "orientation"), 0U) << name;
    ASSERT_EQ(surface.mesh.triangles.size(), mesh.triangles.size()) << name;
    ASSERT_EQ(surface.mesh.points.size(), mesh.points.size()) << name;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {  // STL numbers its points by use
        const Vec3 error =
            surface.mesh.points[static_cast<std::size_t>(surface.mesh.triangles[t][k])] -
            mesh.points[static_cast<std::size_t>(mesh.triangles[t][k])];
        const bool six_digits =
            std::string(name).find("ascii.vtk") != std::string::npos;  // of up to 20 mm
        ASSERT_LE(error.cwiseAbs().maxCoeff(), six_digits ? 1e-4 : 0.0) << name;
      }
    }
  }
}

TEST(ReadSurface, AsciiStlWeldsEqualTexts) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = tube(2.5, 20, 16, 11);
  std::ostringstream text;
  text << "solid tube with spaces\n" << std::setprecision(9);
  for (const Triangle& t : mesh.triangles) {
    text << "facet normal nan 0 0\n outer loop\n";
    for (const int v : t) {
      const Vec3& x = mesh.points[static_cast<std::size_t>(v)];
      text << "  vertex " << x.x() << ' ' << x.y() << ' ' << x.z() << "\r\n";
    }
    text << " endloop\nendfacet\n";
  }
  const std::string whole = text.str() + "endsolid tube\n";
  const Surface surface = read_surface(folder.write("a.stl", whole), LengthUnit::mm);
  EXPECT_EQ(surface.mesh.points.size(), mesh.points.size());
  EXPECT_EQ(topology(surface.mesh).boundary_loops.size(), 2U);
  EXPECT_REFUSED(folder.write("cut.stl", whole.substr(0, whole.size() / 2)), "truncated");
  EXPECT_REFUSED(folder.write("nan.stl", replaced(whole, "vertex 2.5", "vertex nan")),
                 "not a finite position");
  EXPECT_REFUSED(folder.write("comma.stl", replaced(whole, "vertex 2.5", "vertex 2,5")), "2,5");
  EXPECT_REFUSED(folder.write("two.stl", replaced(whole, "endloop", "")), "endloop");
}

TEST(ReadSurface, MixedOrientationIsTurnedOutward) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = tube(2.5, 20, 16, 11);
  for (const std::size_t step : {1, 2, 3, 7}) {
    const Surface surface = read_surface(
        folder.write("mixed.vtp", vtp_text(tests::turned(mesh, step))), LengthUnit::mm);
    EXPECT_EQ(found(surface, "orientation"), (mesh.triangles.size() + step - 1) / step);
    EXPECT_TRUE(topology(surface.mesh).inconsistent_edges.empty());
    EXPECT_NEAR(volume(surface.mesh), volume(mesh), 1e-9);
  }
}

TEST(ReadSurface, MoebiusBandIsAnError) {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i) {
    const double u = 2 * std::numbers::pi * i / kSteps;
    for (const double w : {-1.0, 1.0}) {
      const double r = 5 + w * std::cos(u / 2);
      mesh.points.emplace_back(r * std::cos(u), r * std::sin(u), w * std::sin(u / 2));
    }
  }
  for (int i = 0; i < kSteps; ++i) {
    const bool last = i + 1 == kSteps;  // the strip closes with its sides exchanged
    const int a = 2 * i, b = 2 * i + 1, c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({b, c, d});
  }
  const Surface surface = read_surface(folder.write("m.obj", obj_text(mesh)), LengthUnit::mm);
  EXPECT_EQ(found(surface, "one-sided"), 1U);
  EXPECT_FALSE(check(surface).stentable());
}

TEST(ReadSurface, PolygonsAreCutAndKeptWholeInTheFile) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = tube(2.5, 20, 16, 11);
  std::ostringstream text;
  for (const Vec3& x : mesh.points) text << "v " << x.x() << ' ' << x.y() << ' ' << x.z() << '\n';
  for (std::size_t t = 0; t < mesh.triangles.size();
       t += 2) {  // pairs of triangles are quads; every third one is turned
    const int a = mesh.triangles[t][0] + 1, b = mesh.triangles[t][1] + 1,
              c = mesh.triangles[t][2] + 1;
    const int d = mesh.triangles[t + 1][2] + 1;
    if (t % 3 == 0) {
      text << "f " << a << "/1/1 " << b << "//2 " << c << ' ' << d - 177 << '\n';
    } else {
      text << "f " << d << ' ' << c << ' ' << b << ' ' << a << '\n';
    }
  }
  const Surface surface = read_surface(folder.write("quads.obj", text.str()), LengthUnit::mm);
  EXPECT_EQ(found(surface, "polygon"), 160U);
  EXPECT_EQ(surface.mesh.triangles.size(), 320U);
  EXPECT_TRUE(check(surface).stentable());
  const std::vector<double> numbers(320, 7.0);
  write_surface(surface, surface.mesh.points, none_moved(surface), folder / "quads.vtp", {},
                {{"seven", numbers}});
  const auto back = read_polydata(folder / "quads.vtp");
  EXPECT_EQ(back->GetPolys()->GetNumberOfCells(), 160);
  EXPECT_EQ(back->GetCellData()->GetArray("seven")->GetNumberOfTuples(), 160);
  const Surface again = read_surface(folder / "quads.vtp", LengthUnit::mm);
  EXPECT_EQ(found(again, "orientation"), 0U);
}

TEST(ReadSurface, ConcavePolygonsKeepTheirArea) {
  // A comb with n teeth: 4 n + 2 corners, area 2 n (n teeth of 1 x 1 on a bar of n ... twice as
  // wide).
  constexpr int kTeeth = 7;
  std::vector<Vec3> points = {{2 * kTeeth, 0, 0}};
  for (int i = kTeeth; i-- > 0;) {
    points.emplace_back(2 * i + 2, 1, 0);
    points.emplace_back(2 * i + 1, 1, 0);
    points.emplace_back(2 * i + 1, 3, 0);
    points.emplace_back(2 * i, 3, 0);
  }
  points.emplace_back(0, 0, 0);
  std::vector<int> polygon(points.size());
  for (std::size_t i = 0; i < polygon.size(); ++i) polygon[i] = static_cast<int>(i);
  bool simple = true;
  const auto triangles = triangulate(polygon, points, simple);
  EXPECT_TRUE(simple);
  EXPECT_EQ(triangles.size(), points.size() - 2);
  double area = 0;
  for (const Triangle& t : triangles) {
    const Vec3 u = points[static_cast<std::size_t>(t[1])] - points[static_cast<std::size_t>(t[0])];
    const Vec3 v = points[static_cast<std::size_t>(t[2])] - points[static_cast<std::size_t>(t[0])];
    const double twice = u.x() * v.y() - u.y() * v.x();
    EXPECT_GE(twice, 0);
    area += 0.5 * twice;
  }
  EXPECT_DOUBLE_EQ(area, 2 * kTeeth * 1 + kTeeth * 2);  // bar and teeth
}

TEST(ReadSurface, SeamsUnusedAndCollapsedAreRepaired) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tube(2.5, 20, 16, 11);
  const std::size_t count = mesh.points.size();
  TriangleMesh slit =
      mesh;  // a copy of ring 5 for the triangles above it, 1e-7 of the diagonal away
  for (int j = 0; j < 16; ++j)
    slit.points.push_back(mesh.points[static_cast<std::size_t>(80 + j)] + Vec3(0, 0, 2e-6));
  for (std::size_t t = 160; t < slit.triangles.size(); ++t) {
    for (int& v : slit.triangles[t]) {
      if (v >= 80 && v < 96) v += 96;
    }
  }
  slit.points.emplace_back(100, 100, 100);  // unused
  slit.triangles.push_back({3, 3, 4});
  const Surface surface = read_surface(folder.write("slit.vtp", vtp_text(slit)), LengthUnit::mm);
  EXPECT_EQ(found(surface, "seam"), 16U);
  EXPECT_EQ(found(surface, "unused-point"), 1U);
  EXPECT_EQ(found(surface, "collapsed-triangle"), 1U);
  EXPECT_EQ(surface.mesh.points.size(), count);
  EXPECT_EQ(topology(surface.mesh).boundary_loops.size(), 2U);
  EXPECT_TRUE(check(surface).stentable());

  for (std::size_t p = count; p < count + 16; ++p)
    slit.points[p].z() = mesh.points[p - 96].z();  // now exact copies
  const Surface exact = read_surface(folder.write("slit.vtp", vtp_text(slit)), LengthUnit::mm);
  EXPECT_EQ(found(exact, "duplicate-point"), 16U);
  std::vector<char> moved = none_moved(exact);
  std::vector<Vec3> points = exact.mesh.points;
  moved[85] = 1;
  points[85] += Vec3(0.5, 0, 0);
  write_surface(exact, points, moved, folder / "out.vtp");
  const auto back = read_polydata(folder / "out.vtp");
  EXPECT_EQ(back->GetNumberOfPoints(), static_cast<vtkIdType>(slit.points.size()));
  EXPECT_EQ(Vec3(back->GetPoint(85)), points[85]);
  EXPECT_EQ(Vec3(back->GetPoint(85 + 96)), points[85]) << "all copies of a vertex move together";
}

TEST(ReadSurface, UnitsScaleAndImplausibleOnesNameTheFittingOne) {
  const TemporaryFolder folder;
  TriangleMesh metres = tube(0.005, 0.09, 16, 11);
  const auto path = folder.write("m.vtp", vtp_text(metres));
  const Surface surface = read_surface(path, LengthUnit::m);
  EXPECT_NEAR(surface.mesh.points.back().z(), 90, 1e-12);
  EXPECT_REFUSED(path, "is the unit m?");  // 0.09 mm long
  EXPECT_REFUSED(folder.write("mm.vtp", vtp_text(tube(0.5, 1, 16, 11))), "is the unit cm?");
  EXPECT_NE(refusal(folder.write("big.vtp", vtp_text(tube(9, 90, 16, 11))), LengthUnit::m)
                .find("90000 mm"),
            std::string::npos);
}

TEST(ReadSurface, BadFilesAreOneClearLine) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = tube(2.5, 20, 16, 11);  // 176 points, 320 triangles
  const std::string good = vtp_text(mesh);
  const auto bad = [&](const std::string& what, const std::string& with) {
    return folder.write("bad.vtp", replaced(good, what, with));
  };
  EXPECT_REFUSED(folder / "absent.vtp", "no such file");
  EXPECT_REFUSED(folder / "", "folder");
  EXPECT_REFUSED(folder.write("empty.vtp", ""), "empty");
  EXPECT_REFUSED(folder.write("empty.stl", ""), "empty");
  EXPECT_REFUSED(folder.write("page.vtp", "<!DOCTYPE html><html><body>404</body></html>"),
                 "web page");
  EXPECT_REFUSED(folder.write("page.stl", "<html><body>404</body></html>" + std::string(100, ' ')),
                 "web page");
  EXPECT_REFUSED(folder.write("noise.vtp", std::string("\x01\x7f\x03 noise\0\0", 11)), "no XML");
  EXPECT_REFUSED(folder.write("tube.ply", "ply\n"), "save it as .vtp");
  EXPECT_REFUSED(folder.write("legacy.vtp", "# vtk DataFile Version 4.2\n"), "name it .vtk");
  EXPECT_REFUSED(bad("type=\"PolyData\"", "type=\"ImageData\""), "ImageData");
  EXPECT_REFUSED(bad("NumberOfPoints=\"176\"", "NumberOfPoints=\"-5\""), "not a count");
  EXPECT_REFUSED(bad("NumberOfPoints=\"176\"", "NumberOfPoints=\"1000000000000000000\""),
                 "can hold");
  EXPECT_REFUSED(bad("NumberOfPoints=\"176\"", "NumberOfPoints=\"175\""), "promises");
  EXPECT_REFUSED(bad("NumberOfPolys=\"320\"", "NumberOfPolys=\"abc\""), "not a count");
  EXPECT_REFUSED(bad("NumberOfPolys=\"320\"", "NumberOfPolys=\"319\""), "promises");
  EXPECT_REFUSED(bad("NumberOfPolys=\"320\"", "NumberOfPolys=\"0\""), "promises");
  EXPECT_REFUSED(bad("NumberOfComponents=\"3\"", "NumberOfComponents=\"100000000\""),
                 "within 1 to 1000");
  EXPECT_REFUSED(bad("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\""), "not 3");
  EXPECT_REFUSED(bad("type=\"Float64\"", "type=\"String\""), "Float");
  EXPECT_REFUSED(bad("\n0 1 17\n", "\n0 1 176\n"), "name point 176");
  EXPECT_REFUSED(bad("\n0 1 17\n", "\n0 1 -1\n"), "name point -1");
  EXPECT_REFUSED(bad("\n6\n", "\n5000\n"), "offsets");
  EXPECT_REFUSED(bad("\n2.5 0 0\n", "\nnan 0 0\n"), "point 0");
  EXPECT_REFUSED(bad("\n2.5 0 0\n", "\n2,5 0 0\n"), "");
  EXPECT_REFUSED(bad("\n2.5 0 0\n", "\n2.5e38 0 0\n"), "point 0");
  EXPECT_REFUSED(bad("\n2.5 0 0\n", "\n2.5e9 0 0\n"), "farther out");
  EXPECT_REFUSED(bad("<Piece", "<Piece NumberOfPoints=\"0\"></Piece><Piece"), "no points");
  EXPECT_REFUSED(bad("</Piece>", "</Piece><Piece NumberOfPoints=\"1\"></Piece>"), "several pieces");
  EXPECT_REFUSED(bad("<VTKFile", "<!DOCTYPE x [<!ENTITY a \"b\">]><VTKFile"), "entities");
  EXPECT_REFUSED(bad("byte_order=\"LittleEndian\"", "compressor=\"vtkMagic\""), "vtkMagic");
  EXPECT_REFUSED(bad("<CellData></CellData>",
                     "<CellData><DataArray type=\"Int32\" Name=\"ModelFaceID\" format=\"ascii\">1 "
                     "2 3</DataArray></CellData>"),
                 "promises");

  const std::string stl = binary_stl(mesh);
  EXPECT_REFUSED(folder.write("cut.stl", stl.substr(0, stl.size() - 7)), "truncated");
  EXPECT_REFUSED(folder.write("short.stl", stl.substr(0, 60)), "no STL");
  EXPECT_REFUSED(folder.write("lie.stl", binary_stl(mesh, 0xFFFFFFFFU)), "4294967295");
  EXPECT_REFUSED(folder.write("none.stl", stl.substr(0, 80) + std::string(4, '\0')),
                 "no triangles");
  TriangleMesh infinite = mesh;
  infinite.points[5].y() = std::numeric_limits<double>::infinity();
  EXPECT_REFUSED(folder.write("inf.stl", binary_stl(infinite)), "not a finite position");

  const std::string obj = obj_text(mesh);
  EXPECT_REFUSED(folder.write("range.obj", obj + "f 1 2 177\n"), ":497: vertex 177");
  EXPECT_REFUSED(folder.write("zero.obj", obj + "f 1 2 0\n"), ":497:");
  EXPECT_REFUSED(folder.write("negative.obj", obj + "f 1 2 -177\n"), ":497:");
  EXPECT_REFUSED(folder.write("edge.obj", obj + "f 1 2\n"), "2 corners");
  EXPECT_REFUSED(folder.write("surf.obj", obj + "curv 0 1 1 2\n"), "not understood");
  EXPECT_REFUSED(folder.write("nan.obj", "v nan 0 0\n" + obj), ":1:");
  EXPECT_REFUSED(folder.write("points.obj", obj.substr(0, obj.find("f "))), "no faces");

  vtkSmartPointer<vtkPolyData> data = rich_tube(mesh);
  using Legacy = vtkPolyDataWriter;
  const std::string field =
      written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(42), w.SetFileTypeToBinary(); });
  EXPECT_REFUSED(folder.write("f.vtk", replaced(field, "POINTS 177", "POINTS -5")),
                 "");  // behind field data
  data->GetFieldData()->Initialize();
  const std::string legacy =
      written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(42), w.SetFileTypeToBinary(); });
  EXPECT_REFUSED(folder.write("l.vtk", replaced(legacy, "POINTS 177", "POINTS -5")), "not a count");
  EXPECT_REFUSED(folder.write("l.vtk", replaced(legacy, "POINTS 177", "POINTS 99999999")),
                 "can hold");
  EXPECT_REFUSED(
      folder.write("l.vtk", replaced(legacy, "POLYGONS 320 1280", "POLYGONS 320 9999999")),
      "can hold");
  EXPECT_REFUSED(folder.write("l.vtk", replaced(legacy, "POLYDATA", "STRUCTURED_GRID")),
                 "POLYDATA");
  EXPECT_REFUSED(folder.write("l.vtk", legacy.substr(0, legacy.size() / 3)), "");
  EXPECT_REFUSED(folder.write("l.vtk", "solid\n"), "no legacy");
}

TEST(ReadSurface, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  vtkSmartPointer<vtkPolyData> data = rich_tube(tube(2.5, 20, 12, 6));
  using Xml = vtkXMLPolyDataWriter;
  const std::string files[] = {
      written<Xml>(data, [](Xml& w) { w.SetDataModeToAscii(); }),
      written<Xml>(data, [](Xml& w) { w.SetDataModeToBinary(); }),
      written<Xml>(data, [](Xml& w) { w.SetDataModeToAppended(), w.EncodeAppendedDataOff(); }),
      written<Xml>(data, [](Xml& w) { w.SetDataModeToAppended(), w.EncodeAppendedDataOn(); }),
  };
  for (const std::string& bytes : files) {
    for (std::size_t part = 1; part < 40; ++part)
      refusal(folder.write("cut.vtp", bytes.substr(0, bytes.size() * part / 40)));
  }
}

TEST(ReadSurface, DamagedBytesAreReadOrRefusedButNeverCrash) {
  const TemporaryFolder folder;
  vtkSmartPointer<vtkPolyData> data = rich_tube(tube(2.5, 20, 12, 6));
  using Xml = vtkXMLPolyDataWriter;
  using Legacy = vtkPolyDataWriter;
  const std::pair<const char*, std::string> files[] = {
      {"x.vtp",
       written<Xml>(data, [](Xml& w) { w.SetDataModeToAppended(), w.EncodeAppendedDataOff(); })},
      {"y.vtp", written<Xml>(data, [](Xml& w) { w.SetDataModeToAscii(); })},
      {"z.vtk",
       written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(42), w.SetFileTypeToBinary(); })},
      {"w.vtk", written<Legacy>(data, [](Legacy& w) { w.SetFileVersion(51); })},
      {"v.stl", binary_stl(tube(2.5, 20, 12, 6))},
      {"u.obj", obj_text(tube(2.5, 20, 12, 6))},
  };
  std::mt19937 random(7);
  std::size_t refused = 0;
  for (const auto& [name, bytes] : files) {
    for (int i = 0; i < 40; ++i) {
      std::string damaged = bytes;
      for (int k = 0; k < 3; ++k) {
        damaged[random() % damaged.size()] =
            static_cast<char>(i % 2 == 0 ? random() % 256 : '0' + random() % 10);
      }
      const auto path = folder.write(name, damaged);
      try {
        const Surface surface = read_surface(path, LengthUnit::mm);
        for (const Vec3& x : surface.mesh.points) ASSERT_TRUE(x.allFinite());
        for (const Triangle& t : surface.mesh.triangles) {
          for (const int v : t) ASSERT_LT(static_cast<std::size_t>(v), surface.mesh.points.size());
        }
      } catch (const Error& error) {
        ASSERT_EQ(error.code(), ExitCode::input_file) << error.what();
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 60U);
}

TEST(TryInChild, SurvivesCrashesAndExceptions) {
  EXPECT_EQ(try_in_child([] { return std::string(); }, 1), "");
  EXPECT_EQ(try_in_child([] { return std::string("wrong"); }, 1), "wrong");
  EXPECT_NE(try_in_child(
                []() -> std::string {
                  std::raise(SIGKILL);
                  return {};
                },
                1),
            "");
  EXPECT_EQ(try_in_child([]() -> std::string { throw std::runtime_error("thrown"); }, 1), "thrown");
}

}  // namespace
}  // namespace vstent::vessels
