#pragma once

#include <cstdint>

#include "graspatlas/atlas/atlas.hpp"

namespace graspatlas {

/// Where the facets, vertices and neighbours of each chart begin, when those of all charts stand one after another:
/// arrays [n + 1] of the caller's, the last number is how many there are in all.
struct FlatStarts {
  std::int64_t *facets, *vertices, *neighbours;
};

/// An atlas as arrays of the caller's, for n charts of dimension k with f facets, v vertices and p neighbours in all.
struct FlatAtlas {
  double *centers, *bases;                ///< [n x configuration_size], [n x k x tangent_size]
  double *residuals, *regularities;       ///< [n]
  bool* nearly_singular;                  ///< [n]
  double *facet_normals, *facet_offsets;  ///< [f x k], [f]
  std::int32_t* facet_tags;               ///< [f]; those of neighbours are charts' numbers
  double* vertices;                       ///< [v x k]
  std::uint8_t* vertex_closed;            ///< [v]: Closed
  std::int32_t* neighbour_pairs;          ///< [p x 2]
};

void write_starts(const Atlas& atlas, const FlatStarts& out);

/// Copies all charts in the order of the algorithm, on the atlas's threads.
void flatten(const Atlas& atlas, const FlatStarts& starts, const FlatAtlas& out);

/// The same, and gives the atlas's memory back meanwhile: it is lost. Together they take little more than the atlas
/// did, less if its charts' places were forgotten before the arrays were made.
void move_flat(Atlas& atlas, const FlatStarts& starts, const FlatAtlas& out);

}  // namespace graspatlas
