#include "meshing/edit_mesh.hpp"

#include <Eigen/Geometry>

#include "vessels/half_edges.hpp"

namespace vstent::meshing {

EditMesh::EditMesh(std::vector<Vec3> all_points, std::vector<Triangle> all_triangles,
                   std::vector<int> face_of_triangle)
    : points(std::move(all_points)),
      triangles(std::move(all_triangles)),
      face(std::move(face_of_triangle)),
      triangle_lives(triangles.size(), 1),
      vertex_lives(points.size(), 1),
      twin_(3 * triangles.size(), -1),
      leaving_(points.size(), -1) {
  const TriangleMesh mesh{points, triangles};
  const auto edges = vessels::sorted_half_edges(mesh);
  const auto half_edge = [&](const vessels::HalfEdge& e) {
    const int first = e.ascending ? e.low : e.high;
    int h = 3 * e.triangle;
    while (from(h) != first) ++h;
    return h;
  };
  vessels::for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
    if (end - begin == 2) pair(half_edge(edges[begin]), half_edge(edges[begin + 1]));
  });
  for (int h = 0; h < half_edges(); ++h) {
    int& known = leaving_[static_cast<std::size_t>(from(h))];
    if (known < 0 || twin(h) < 0) known = h;
  }
}

Vec3 EditMesh::doubled_area(int t) const {
  const Triangle& c = triangles[static_cast<std::size_t>(t)];
  return (at(c[1]) - at(c[0])).cross(at(c[2]) - at(c[0]));
}

void EditMesh::pair(int h, int g) {
  if (h >= 0) twin_[static_cast<std::size_t>(h)] = g;
  if (g >= 0) twin_[static_cast<std::size_t>(g)] = h;
}

void EditMesh::leaving(int v, std::vector<int>& ring) const {
  ring.clear();
  // A border vertex's half-edge is the border itself, with all triangles on its left.
  const int first = leaving_[static_cast<std::size_t>(v)];
  int h = first;
  do {
    ring.push_back(h);
    h = twin(previous(h));
  } while (h >= 0 && h != first);
}

bool EditMesh::joined(int a, int b, std::vector<int>& ring) const {
  leaving(a, ring);
  for (const int h : ring)
    if (to(h) == b || apex(h) == b) return true;
  return false;
}

int EditMesh::split(int h, const Vec3& place) {
  const int m = static_cast<int>(points.size());
  points.push_back(place);
  vertex_lives.push_back(1);
  const int g = twin(h);
  // Each side's triangle (a, b, apex) becomes (a, m, apex) and (m, b, apex), seen from its own
  // edge.
  const auto cut = [&](int edge) {
    const int t = edge / 3;
    const int b = to(edge), top = apex(edge);
    const int fresh = static_cast<int>(triangles.size());
    triangles.push_back({m, b, top});
    face.push_back(face[static_cast<std::size_t>(t)]);
    triangle_lives.push_back(1);
    twin_.resize(twin_.size() + 3, -1);
    triangles[static_cast<std::size_t>(t)][static_cast<std::size_t>(next(edge) % 3)] = m;
    const int outer = twin(next(edge));
    pair(3 * fresh + 1, outer);
    pair(next(edge), 3 * fresh + 2);
    auto& of_b = leaving_[static_cast<std::size_t>(b)];
    if (of_b == next(edge)) of_b = 3 * fresh + 1;
    return 3 * fresh;
  };
  const int rest = cut(h);
  leaving_.push_back(rest);
  if (g < 0) {
    pair(rest, -1);
    return m;
  }
  const int other_rest = cut(g);
  // h runs a -> m, rest m -> b; g runs b -> m, other_rest m -> a.
  pair(h, other_rest);
  pair(g, rest);
  return m;
}

void EditMesh::flip(int h) {
  const int g = twin(h);
  const int a = from(h), b = to(h), c = apex(h), d = apex(g);
  const int b_c = twin(next(h)), c_a = twin(previous(h));
  const int a_d = twin(next(g)), d_b = twin(previous(g));
  const int t = h / 3, u = g / 3;
  // Around the quadrilateral a, d, b, c.
  triangles[static_cast<std::size_t>(t)] = {d, c, a};
  triangles[static_cast<std::size_t>(u)] = {c, d, b};
  const auto move = [&](int v, int old_first, int old_second, int fresh) {
    int& known = leaving_[static_cast<std::size_t>(v)];
    if (known == old_first || known == old_second) known = fresh;
  };
  const int of_c = previous(h), of_d = previous(g), of_b = next(h), of_a = next(g);
  pair(3 * t, 3 * u);
  pair(3 * t + 1, c_a);
  pair(3 * t + 2, a_d);
  pair(3 * u + 1, d_b);
  pair(3 * u + 2, b_c);
  move(a, h, of_a, 3 * t + 2);
  move(b, g, of_b, 3 * u + 2);
  move(c, of_c, of_c, 3 * t + 1);
  move(d, of_d, of_d, 3 * u + 1);
}

void EditMesh::collapse(int h) {
  const int g = twin(h);
  const int a = from(h), b = to(h), c = apex(h), d = apex(g);
  std::vector<int> ring;
  leaving(a, ring);
  const int b_c = twin(next(h)), c_a = twin(previous(h));
  const int a_d = twin(next(g)), d_b = twin(previous(g));
  for (const int r : ring)
    triangles[static_cast<std::size_t>(r / 3)][static_cast<std::size_t>(r % 3)] = b;
  triangle_lives[static_cast<std::size_t>(h / 3)] = 0;
  triangle_lives[static_cast<std::size_t>(g / 3)] = 0;
  vertex_lives[static_cast<std::size_t>(a)] = 0;
  pair(b_c, c_a);
  pair(a_d, d_b);
  // c_a and a_d are there, as the vertex that goes is not on the border.
  const auto keep = [&](int v, int candidate) {
    int& known = leaving_[static_cast<std::size_t>(v)];
    if (known / 3 == h / 3 || known / 3 == g / 3) known = candidate;
  };
  keep(b, c_a);  // it ran a -> c
  keep(c, b_c >= 0 ? b_c : next(c_a));
  keep(d, a_d);
}

}  // namespace vstent::meshing
