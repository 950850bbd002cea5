#include "xpbd/rigid_stiffness.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <random>

namespace vstent::tests {
namespace {

using xpbd::Matrix6;
using xpbd::RigidSolver;
using xpbd::RigidStiffness;

constexpr int kRows = 12, kColumns = 10;

/// A plate of bodies a millimetre apart, each on springs to the next ones, one corner held, and the
/// same as one matrix.
struct Plate {
  RigidStiffness stiffness;
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(6 * kRows * kColumns, 6 * kRows * kColumns);

  Plate() {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < kRows; ++i)
      for (int j = 0; j < kColumns; ++j) {
        const int body = i * kColumns + j;
        stiffness.centres.emplace_back(i, j, 0.1 * normal(random));
        pairs.emplace_back(body, body);
        if (j > 0) pairs.emplace_back(body, body - 1);
        if (i > 0) pairs.emplace_back(body, body - kColumns);
      }
    stiffness.set_neighbours(pairs);
    stiffness.block(0, 0) += Matrix6::Identity();
    for (const auto& [a, b] : pairs) {
      if (a == b) continue;
      const auto& ends = stiffness.centres;
      const Vec3 middle =
          0.5 * (ends[static_cast<std::size_t>(a)] + ends[static_cast<std::size_t>(b)]);
      for (int spring = 0; spring < 6; ++spring) {  // through points near the middle
        const Vec3 point = middle + 0.3 * Vec3(normal(random), normal(random), normal(random));
        const Vec3 along = Vec3(normal(random), normal(random), normal(random)).normalized();
        const auto work = [&](int body) {
          Eigen::Matrix<double, 6, 1> of_unit;
          of_unit << along, (point - ends[static_cast<std::size_t>(body)]).cross(along);
          return of_unit;
        };
        stiffness.block(a, a) += work(a) * work(a).transpose();
        stiffness.block(b, b) += work(b) * work(b).transpose();
        stiffness.block(a, b) -= work(a) * work(b).transpose();
      }
    }
    for (const auto& [a, b] : pairs) {
      whole.block<6, 6>(6 * a, 6 * b) = stiffness.block(a, b);
      whole.block<6, 6>(6 * b, 6 * a) = stiffness.block(a, b).transpose();
    }
  }

  Eigen::MatrixXd answers(int most_factorised) {
    RigidSolver solver(most_factorised);
    solver.analyse(stiffness);
    EXPECT_TRUE(solver.factorise(stiffness));
    Eigen::MatrixXd all(whole.rows(), whole.cols());
    for (Eigen::Index k = 0; k < whole.cols(); ++k)
      all.col(k) = solver.solve(stiffness, Eigen::VectorXd::Unit(whole.cols(), k));
    return all;
  }
};

TEST(RigidSolver, FewBodiesAreAnsweredExactly) {
  Plate plate;
  const Eigen::MatrixXd inverse =
      plate.whole.ldlt().solve(Eigen::MatrixXd::Identity(plate.whole.rows(), plate.whole.cols()));
  // Rounding, times the condition number, which is below 1e6.
  EXPECT_LT((plate.answers(kRows * kColumns) - inverse).norm(), 1e-9 * inverse.norm());
}

TEST(RigidSolver, ManyBodiesAreAnsweredByASymmetricPositiveMatrix) {
  Plate plate;
  const Eigen::MatrixXd answers = plate.answers(20);
  EXPECT_LT((answers - answers.transpose()).norm(), 1e-9 * answers.norm());
  const Eigen::LLT<Eigen::MatrixXd> factor(plate.whole);
  const Eigen::MatrixXd root = factor.matrixL();
  const auto least_and_most = [&](const Eigen::MatrixXd& b) {  // eigenvalues of b K
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(root.transpose() * b * root).eigenvalues();
    return std::pair{values.minCoeff(), values.maxCoeff()};
  };
  // What a sweep, or the groups' answer, leaves of a motion is in energy no more than the motion:
  // 1 - B K has eigenvalues from 0 up to, but without, 1.
  const auto [least, most] = least_and_most(answers);
  EXPECT_LT(most, 1 + 1e-9);
  // Sweeps there and back alone are (D + L)^-T D (D + L)^-1.
  Eigen::MatrixXd lower = plate.whole.triangularView<Eigen::StrictlyLower>();
  Eigen::MatrixXd diagonal = Eigen::MatrixXd::Zero(lower.rows(), lower.cols());
  for (Eigen::Index k = 0; k < lower.rows(); k += 6) {
    diagonal.block<6, 6>(k, k) = plate.whole.block<6, 6>(k, k);
    lower.block<6, 6>(k, k) = diagonal.block<6, 6>(k, k);
  }
  const Eigen::MatrixXd there = lower.inverse();
  const double least_of_sweeps = least_and_most(there.transpose() * diagonal * there).first;
  EXPECT_GT(least, 4 * least_of_sweeps) << "groups should make up for what sweeps cannot reach";
}

}  // namespace
}  // namespace vstent::tests
