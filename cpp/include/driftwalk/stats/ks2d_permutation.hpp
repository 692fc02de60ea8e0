// Permutations of the KS statistic: the points stay, only the labels of whole blocks move.
#pragma once

#include "driftwalk/stats/ks2d.hpp"

#include <cstdint>

namespace driftwalk {

// For each of `permutations` label sets, D1 + D2 in units of 1 / (n1 n2).
//
// `block_of` names the block of every pooled point (sample 2 after sample 1); label set p gives
// block b to sample 2 where labels[p * blocks + b] is 1. Every label set must leave n1 points in
// sample 1.
void ks_permutations(const double* x, const double* y, std::int64_t n1, std::int64_t n2,
                     const std::int32_t* block_of, std::int64_t blocks, const std::uint8_t* labels,
                     std::int64_t permutations, KsTies ties, std::int64_t* statistic);

} // namespace driftwalk
