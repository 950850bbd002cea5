// A level set's grid, for the files that see OpenVDB.
#pragma once

#include <openvdb/openvdb.h>

#include "sdf/level_set_implementation.hpp"

namespace vstent::sdf {

struct VdbGrid {
  openvdb::FloatGrid::ConstPtr grid;
  std::array<int, 3> first_node{};  ///< the grid's node (0, 0, 0) is at first_node * voxel size

  openvdb::Coord coord(const std::array<int, 3>& node) const {
    return {node[0] - first_node[0], node[1] - first_node[1], node[2] - first_node[2]};
  }
};

/// Registers OpenVDB's types once; any number of threads may call it.
void initialise_openvdb();

/// `inside` is the value deeper than the band; 0 stands for minus the background.
LevelSet level_set_of(openvdb::FloatGrid::ConstPtr grid, float inside = 0);

}  // namespace vstent::sdf
