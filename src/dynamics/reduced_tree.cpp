#include "dynamics/reduced_tree.h"

#include <map>

#include "bielle/dynamics/rnea.h"
#include "dynamics/point_spring.h"

namespace bielle {
namespace {

template <typename Columns>
void resize(const ReducedJoint& place, Columns& columns) {
  columns.outer = place.outer;
  for (auto* m : {&columns.J, &columns.dV, &columns.dA, &columns.dW}) m->setZero(6, place.outer.size());
}

}  // namespace

template <typename T>
ReducedTreeOf<T>::ReducedTreeOf(const Model& model, const Reduction& reduction, const std::vector<int>& tips)
    : model_(model), reduction_(reduction) {
  size_t groups = 0;
  for (const ReducedJoint& place : reduction.joints) {
    Link link;
    if (place.cluster >= 0) {
      link.dofs = reduction.clusters[place.cluster].dofs;
      groups = std::max(groups, reduction.clusters[place.cluster].groups.size());
    } else {
      const Joint& joint = model.joints()[place.joint];
      for (int k = 0; k < joint.nv; ++k) link.dofs.push_back(joint.idx_v + k);
    }
    resize(place, link.columns);
    for (Matrix6X<T>* m : {&link.YJ, &link.BtJ, &link.Gy, &link.Gv}) m->setZero(6, place.size);
    links_.push_back(std::move(link));
  }
  for (int body : tips) tips_.push_back(makeColumns(body));
  for (const PointSpring& spring : model.pointSprings()) springs_.push_back(makeSpringEnds(spring));
  for (Matrix6X<T>* m : {&after_y_, &after_v_}) m->setZero(6, groups);
}

template <typename T>
typename ReducedTreeOf<T>::Tip ReducedTreeOf<T>::makeColumns(int body) const {
  Tip tip{makeTip(model_, reduction_, body), {}};
  resize(tip.place, tip.columns);
  return tip;
}

template <typename T>
typename ReducedTreeOf<T>::SpringEnds ReducedTreeOf<T>::makeSpringEnds(const PointSpring& spring) const {
  SpringEnds out{makeColumns(spring.body1), makeColumns(spring.body2), {}};
  std::map<int, SpringCoordinate> coordinates;
  const auto enter = [&](const std::vector<int>& outer, int SpringCoordinate::*column) {
    for (size_t o = 0; o < outer.size(); ++o) {
      coordinates[outer[o]].index = outer[o];
      coordinates[outer[o]].*column = static_cast<int>(o);
    }
  };
  enter(out.tip1.place.outer, &SpringCoordinate::column1);
  enter(out.tip2.place.outer, &SpringCoordinate::column2);
  for (const auto& [index, coordinate] : coordinates) out.coordinates.push_back(coordinate);
  return out;
}

template <typename T>
void ReducedTreeOf<T>::clearAfter(size_t groups) {
  after_y_.leftCols(groups).setZero();
  after_v_.leftCols(groups).setZero();
}

// Columns of the parent's outer coordinates, then of the parent itself along the path.
template <typename T>
void ReducedTreeOf<T>::updateColumns(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts,
                                     const ReducedJoint& place, Depth depth, Columns& out) const {
  if (place.parent < 0) return;
  const ReducedJoint& up = reduction_.joints[place.parent];
  const Link& parent = links_[place.parent];
  const Eigen::Index inherited = up.outer.size(), n = parent.dofs.size();
  const bool velocities = depth != Depth::Twists, all = depth == Depth::All;
  out.J.leftCols(inherited) = parent.columns.J;
  if (velocities) out.dV.leftCols(inherited) = parent.columns.dV;
  if (all) {
    out.dA.leftCols(inherited) = parent.columns.dA;
    out.dW.leftCols(inherited) = parent.columns.dW;
  }
  if (up.cluster < 0) {
    const int k = parent.dofs.front();
    out.J.rightCols(n) = ws.J.middleCols(k, n);
    if (velocities) out.dV.rightCols(n) = ws.dV.middleCols(k, n);
    if (!all) return;
    out.dA.rightCols(n) = ws.dA.middleCols(k, n);
    out.dW.rightCols(n) = ws.dJ.middleCols(k, n) + ws.dV.middleCols(k, n);
    return;
  }
  const ClusterMotionOf<T>& motion = *lifts[up.cluster].motion;
  for (int c = 0; c < up.size; ++c) {
    const Eigen::Index from = n * c + place.path.back(), to = inherited + c;
    out.J.col(to) = motion.J.col(from);
    if (velocities) out.dV.col(to) = motion.dV.col(from);
    if (!all) continue;
    out.dA.col(to) = motion.dA.col(from);
    out.dW.col(to) = motion.dW.col(from);
  }
}

// M of Eq. (3), and (YJ)~.
template <typename T>
void ReducedTreeOf<T>::addMassWithin(const WorkspaceOf<T>& ws, const ClusterLiftOf<T>* lift, const ReducedJoint& place,
                                     Link& link, typename ArgumentsOf<T>::Matrix M) {
  const int n = static_cast<int>(link.dofs.size()), o = place.offset;
  if (!lift) {
    const int first = link.dofs.front();
    link.YJ = ws.YJ.middleCols(first, n);
    M.block(o, o, n, n).noalias() = ws.J.middleCols(first, n).transpose().lazyProduct(link.YJ);
    M.block(o, o, n, n).diagonal() += ws.armature.segment(first, n);
    return;
  }
  const ClusterMotionOf<T>& motion = *lift->motion;
  const MatrixX<T>& N = motion.basis->N;
  const std::vector<DofGroup>& groups = motion.cluster.groups;
  M.block(o, o, place.size, place.size).setZero();
  for (int c = 0; c < place.size; ++c) {
    clearAfter(groups.size());
    Vector6<T> total = Vector6<T>::Zero();
    for (int g = static_cast<int>(groups.size()) - 1; g >= 0; --g) {
      const DofGroup& group = groups[g];
      Vector6<T> sum = after_y_.col(g);
      for (int k = group.begin; k < group.end; ++k) {
        const int dof = link.dofs[k];
        const T row = ws.YJ.col(dof).dot(motion.J.col(n * c + k)) + ws.J.col(dof).dot(after_y_.col(g)) +
                      ws.armature[dof] * N(k, c);
        for (int d = 0; d < place.size; ++d) M(o + d, o + c) += N(k, d) * row;
        sum += N(k, c) * ws.YJ.col(dof);
      }
      if (group.parent_group >= 0) {
        after_y_.col(group.parent_group) += sum;
      } else {
        total += sum;
      }
    }
    link.YJ.col(c) = total;
  }
}

template <typename T>
void ReducedTreeOf<T>::updateMassMatrix(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts,
                                        typename ArgumentsOf<T>::Matrix M) {
  M.setZero();
  for (size_t u = 0; u < links_.size(); ++u) {
    const ReducedJoint& place = reduction_.joints[u];
    Link& link = links_[u];
    const ClusterLiftOf<T>* lift = place.cluster >= 0 ? &lifts[place.cluster] : nullptr;
    updateColumns(ws, lifts, place, Depth::Twists, link.columns);
    addMassWithin(ws, lift, place, link, M);
    for (size_t o = 0; o < place.outer.size(); ++o)
      for (int c = 0; c < place.size; ++c) {
        const T m = link.columns.J.col(o).dot(link.YJ.col(c));
        M(place.outer[o], place.offset + c) = m;
        M(place.offset + c, place.outer[o]) = m;
      }
  }
  for (Tip& tip : tips_) updateColumns(ws, lifts, tip.place, Depth::Twists, tip.columns);
}

template <typename T>
void ReducedTreeOf<T>::updateTipVelocities(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts) {
  for (size_t u = 0; u < links_.size(); ++u)
    updateColumns(ws, lifts, reduction_.joints[u], Depth::Velocities, links_[u].columns);
  for (Tip& tip : tips_) updateColumns(ws, lifts, tip.place, Depth::Velocities, tip.columns);
}

// A joint outside all loops: its own entries, and Eq. (1) with N = 1.
template <typename T>
void ReducedTreeOf<T>::addFreeWithin(const WorkspaceOf<T>& ws, const ReducedJoint& place, Link& link,
                                     typename ArgumentsOf<T>::Matrix A_y, typename ArgumentsOf<T>::Matrix A_v) const {
  const int first = link.dofs.front(), n = static_cast<int>(link.dofs.size());
  link.YJ = ws.YJ.middleCols(first, n);
  link.BtJ = ws.BtJ.middleCols(first, n);
  link.Gy = ws.Gq.middleCols(first, n);
  link.Gv = ws.Gv.middleCols(first, n);
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j) {
      const auto entry = calcDerivativeEntry(model_, ws, first + j, first + k);
      A_y(place.offset + j, place.offset + k) = entry.q;
      A_v(place.offset + j, place.offset + k) = entry.v;
    }
}

// Eqs. (1) and (3)
template <typename T>
void ReducedTreeOf<T>::addClusterWithin(const WorkspaceOf<T>& ws, const ClusterLiftOf<T>& lift,
                                        const ReducedJoint& place, Link& link, typename ArgumentsOf<T>::Matrix A_y,
                                        typename ArgumentsOf<T>::Matrix A_v) {
  const ClusterMotionOf<T>& motion = *lift.motion;
  const MatrixX<T>&N = motion.basis->N, &Z = motion.Z, &dy = motion.dy, &dv = motion.dv;
  const std::vector<DofGroup>& groups = motion.cluster.groups;
  const int n = static_cast<int>(link.dofs.size()), o = place.offset;
  for (int c = 0; c < place.size; ++c) {
    clearAfter(groups.size());
    Vector6<T> YJ = Vector6<T>::Zero(), BtJ = YJ, Gy = YJ, Gv = YJ;
    for (int g = static_cast<int>(groups.size()) - 1; g >= 0; --g) {
      const DofGroup& group = groups[g];
      const Vector6<T> after_y = after_y_.col(g), after_v = after_v_.col(g);
      Vector6<T> sum_y = after_y, sum_v = after_v;
      for (int k = group.begin; k < group.end; ++k) {
        const int dof = link.dofs[k], at = n * c + k;
        const T armature = ws.armature[dof];
        const T row_y = ws.YJ.col(dof).dot(motion.dA.col(at)) + ws.BtJ.col(dof).dot(motion.dV.col(at)) +
                        ws.J.col(dof).dot(after_y) + armature * dy(k, c) - (*lift.KN)(k, c) +
                        ws.stiffness[dof] * N(k, c) + ws.resistance[dof] * Z(k, c);
        const T row_v = ws.YJ.col(dof).dot(motion.dW.col(at)) + ws.BtJ.col(dof).dot(motion.J.col(at)) +
                        ws.J.col(dof).dot(after_v) + armature * dv(k, c) + ws.resistance[dof] * N(k, c);
        for (int d = 0; d < place.size; ++d) {
          A_y(o + d, o + c) += N(k, d) * row_y;
          A_v(o + d, o + c) += N(k, d) * row_v;
        }
        YJ += N(k, c) * ws.YJ.col(dof);
        BtJ += N(k, c) * ws.BtJ.col(dof);
        sum_y += N(k, c) * ws.Gq.col(dof) + Z(k, c) * ws.Gv.col(dof) + dy(k, c) * ws.YJ.col(dof);
        sum_v += N(k, c) * ws.Gv.col(dof) + dv(k, c) * ws.YJ.col(dof);
      }
      if (group.parent_group >= 0) {
        after_y_.col(group.parent_group) += sum_y;
        after_v_.col(group.parent_group) += sum_v;
      } else {
        Gy += sum_y;
        Gv += sum_v;
      }
    }
    link.YJ.col(c) = YJ;
    link.BtJ.col(c) = BtJ;
    link.Gy.col(c) = Gy;
    link.Gv.col(c) = Gv;
  }
}

template <typename T>
void ReducedTreeOf<T>::addPointSpring(const WorkspaceOf<T>& ws, const PointSpring& spring, const SpringEnds& ends,
                                      typename ArgumentsOf<T>::Matrix A_y, typename ArgumentsOf<T>::Matrix A_v) const {
  const PointSpringLine<T> line(ws, spring);
  const Columns &in1 = ends.tip1.columns, &in2 = ends.tip2.columns;
  const auto read = [](const Matrix6X<T>& columns, int at) {
    return at < 0 ? Vector6<T>(Vector6<T>::Zero()) : Vector6<T>(columns.col(at));
  };
  for (const SpringCoordinate& by : ends.coordinates) {
    const auto change = line.calcChange(read(in1.J, by.column1), read(in2.J, by.column2), read(in1.dV, by.column1),
                                        read(in2.dV, by.column2));
    for (const SpringCoordinate& of : ends.coordinates) {
      if (of.column1 >= 0) {
        A_y(of.index, by.index) -= in1.J.col(of.column1).dot(change.wrench1);
        A_v(of.index, by.index) -= in1.J.col(of.column1).dot(change.wrench_v);
      }
      if (of.column2 >= 0) {
        A_y(of.index, by.index) += in2.J.col(of.column2).dot(change.wrench2);
        A_v(of.index, by.index) += in2.J.col(of.column2).dot(change.wrench_v);
      }
    }
  }
}

template <typename T>
void ReducedTreeOf<T>::updateDerivatives(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts,
                                         typename ArgumentsOf<T>::Matrix A_y, typename ArgumentsOf<T>::Matrix A_v) {
  A_y.setZero();
  A_v.setZero();
  for (size_t u = 0; u < links_.size(); ++u) {
    const ReducedJoint& place = reduction_.joints[u];
    Link& link = links_[u];
    updateColumns(ws, lifts, place, Depth::All, link.columns);
    if (place.cluster >= 0) {
      addClusterWithin(ws, lifts[place.cluster], place, link, A_y, A_v);
    } else {
      addFreeWithin(ws, place, link, A_y, A_v);
    }
    for (size_t o = 0; o < place.outer.size(); ++o) {  // Eq. (2)
      const int beta = place.outer[o];
      const Columns& in = link.columns;
      const Vector6<T> J = in.J.col(o), dV = in.dV.col(o), dA = in.dA.col(o), dW = in.dW.col(o);
      for (int c = 0; c < place.size; ++c) {
        const int alpha = place.offset + c;
        A_y(alpha, beta) = link.YJ.col(c).dot(dA) + link.BtJ.col(c).dot(dV);
        A_v(alpha, beta) = link.YJ.col(c).dot(dW) + link.BtJ.col(c).dot(J);
        A_y(beta, alpha) = J.dot(link.Gy.col(c));
        A_v(beta, alpha) = J.dot(link.Gv.col(c));
      }
    }
  }
  for (Tip& tip : tips_) updateColumns(ws, lifts, tip.place, Depth::All, tip.columns);
  for (size_t s = 0; s < springs_.size(); ++s) {
    SpringEnds& ends = springs_[s];
    for (Tip* tip : {&ends.tip1, &ends.tip2}) updateColumns(ws, lifts, tip->place, Depth::Velocities, tip->columns);
    addPointSpring(ws, model_.pointSprings()[s], ends, A_y, A_v);
  }
}

template class ReducedTreeOf<double>;
template class ReducedTreeOf<Lanes>;

}  // namespace bielle
