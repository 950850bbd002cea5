// Values on 8^3 leaves as the sampler reads them, whoever owns them. Inside this folder only.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "sdf/index_table.hpp"
#include "sdf/solid.hpp"

namespace vstent::sdf {

/// Finds the 512 values of the leaf (i, j, k), which begins at node 8 (i, j, k). Where no leaf was
/// put, they are all `outside`, or `inside` where that was said.
class LeafDirectory {
 public:
  LeafDirectory(float outside, float inside);
  void put(int i, int j, int k, const float* values) { slot(i, j, k) = values; }
  void put_inside(int i, int j, int k) { slot(i, j, k) = inside_->data(); }
  /// Of 16^3 leaves, none of which has been put; the first is (16 i, 16 j, 16 k).
  void put_inside_page(int i, int j, int k);
  const float* find(int i, int j, int k) const {
    const int page = table_.find({i >> 4, j >> 4, k >> 4});
    return page < 0 ? outside_->data() : (*pages_[static_cast<std::size_t>(page)])[place(i, j, k)];
  }
  std::size_t bytes() const;

 private:
  friend class LeafCursor;
  using Page = std::array<const float*, 4096>;  // 16^3 leaves
  using Constant = std::array<float, 512>;
  static std::size_t place(int i, int j, int k) {
    return static_cast<std::size_t>((i & 15) << 8 | (j & 15) << 4 | (k & 15));
  }
  const float*& slot(int i, int j, int k);

  IndexTable table_;
  std::vector<Page*> pages_;
  std::vector<std::unique_ptr<Page>> owned_pages_;
  Page* inside_page_ = nullptr;
  std::unique_ptr<Constant> outside_, inside_;
};

struct LeafField {
  LeafDirectory leaves;
  double voxel_size = 0;
  Vec3 origin = Vec3::Zero();  ///< world position of node (0, 0, 0)
  float outside = 0;           ///< the value beyond the band, outside
  float inside = 0;            ///< and inside, negative
};

/// One thread's view: points that follow one another in space find their leaves ready.
class LeafCursor {
 public:
  explicit LeafCursor(const LeafField& field) : field_(field) {}
  /// As LevelSet::sample.
  Sample sample(const Vec3& x);
  /// The same bits: finds and fetches the nodes of several points before it looks at any.
  void sample(std::span<const Vec3> points, std::span<Sample> samples);
  /// With a value of third order where the field is smooth: less the bend along each axis that
  /// linear interpolation leaves out.
  Sample sample_closely(const Vec3& x);

 private:
  struct Stencil;
  /// Where the 4^3 nodes around a point are.
  struct Place {
    std::array<const float*, 8> leaves;  // k fastest; some may hold none of them
    std::array<int, 3> first;            // node in the first leaf
    std::array<double, 3> fraction;      // of the way from the second node to the third
    bool is_far;                         // beyond what can be indexed
    void prefetch() const;
  };
  template <class Interpolate>
  Sample sample(const Place& place, Interpolate&& interpolate) const;
  Place place_of(const Vec3& x);
  void move_to(int i, int j, int k, unsigned wanted);
  const float* find(int i, int j, int k);

  const LeafField& field_;
  std::array<const float*, 8> leaves_{};  // from (i, j, k) on, k fastest
  unsigned found_ = 0;                    // which of them
  int i_ = 0, j_ = 0, k_ = 0;
  IndexTable::Index page_index_{};
  const LeafDirectory::Page* page_ = nullptr;
};

}  // namespace vstent::sdf
