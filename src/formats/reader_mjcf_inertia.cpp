// Inertias as given, or from geoms and the files of their meshes; and what <compiler> makes of them.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/exact_moments.h"
#include "formats/mesh.h"
#include "formats/mesh_inertia.h"
#include "formats/reader_mjcf.h"
#include "math/decompositions.h"

namespace bielle {

void MjcfReader::readInertiaSettings(MjcfElement& compiler) {
  inertia_from_geom_ = compiler.getText("inertiafromgeom", inertia_from_geom_);
  if (inertia_from_geom_ != "true" && inertia_from_geom_ != "false" && inertia_from_geom_ != "auto")
    compiler.fail("its inertiafromgeom is '" + inertia_from_geom_ + "'", "use true, false or auto");
  if (const std::vector<double> groups = compiler.getNumbers("inertiagrouprange", 2, 2); !groups.empty())
    first_group_ = groups[0], last_group_ = groups[1];
  least_mass_ = compiler.getNumber("boundmass", least_mass_);
  least_moment_ = compiler.getNumber("boundinertia", least_moment_);
  total_mass_ = compiler.getNumber("settotalmass", total_mass_);
  balances_inertia_ = compiler.getFlag("balanceinertia", balances_inertia_);
  is_exact_ = compiler.getFlag("exactmeshinertia", is_exact_);
  discards_visuals_ = compiler.getFlag("discardvisual", discards_visuals_);
  for (const char* without_effect : {"fusestatic", "convexhull", "usethread", "texturedir"})
    compiler.find(without_effect);
}

void MjcfReader::readMesh(const XMLElement& e) {
  MjcfElement mesh(e, "", settings_);
  const std::string file = mesh.getText("file");
  const std::filesystem::path name_of_file = std::filesystem::path(file).filename();
  std::string name = getAttribute(&e, "name");
  if (name.empty()) name = name_of_file.stem().string();
  MeshAsset asset;
  asset.visual.shape = Visual::Shape::Mesh;
  asset.visual.size = mesh.getVector("scale", Vector3d::Ones());
  asset.visual.mesh =
      (std::filesystem::path(mesh_directory_) / (strips_path_ ? name_of_file : std::filesystem::path(file))).string();
  asset.p_ref = mesh.getVector("refpos", Vector3d::Zero());
  if (const std::vector<double> q = mesh.getNumbers("refquat", 4, 4); !q.empty()) {
    const Eigen::Vector4d xyzw(q[1], q[2], q[3], q[0]);
    const double norm = xyzw.stableNorm();
    if (!(norm > 1e-12) || !std::isfinite(norm))
      mesh.fail("its refquat has zero length", "give a unit quaternion w x y z");
    asset.R_ref = Eigen::Quaterniond(Eigen::Vector4d(xyzw / norm)).toRotationMatrix();
  }
  asset.inertia = mesh.getText("inertia");
  for (const char* drawn : {"smoothnormal", "maxhullvert", "content_type"}) mesh.find(drawn);
  if (file.empty()) return mesh.leaveOut("a mesh without a file is left out");
  meshes_[name] = asset;
}

namespace {

// Whether MuJoCo's inertial frame is the body's own: by frames those of <inertial> or of geoms. Where there is not one alone, its
// axes are the principal ones by falling moments.
bool isOwnFrame(const std::vector<SE3>& frames, const Inertia& inertia) {
  constexpr double kZero = 1e-14;  // mjEPS
  if (frames.size() == 1) return frames[0].p.isZero(kZero) && frames[0].R.isIdentity(kZero);
  const Matrix3d& I = inertia.I_com;
  return inertia.com.isZero(kZero) && I.isDiagonal(kZero) && I(0, 0) >= I(1, 1) && I(1, 1) >= I(2, 2);
}

// Of the box that has these moments per mass: MuJoCo 2 weighs meshes by it.
double calcBoxVolume(const Matrix3d& I) {
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(I).eigenvalues();
  const Vector3d squares = 6 * (Vector3d::Constant(moments.sum()) - 2 * moments);
  return std::sqrt(squares.cwiseMax(0).prod());
}

}  // namespace

Inertia MjcfReader::readInertia(const std::vector<Child>& children, MjcfBody& soft) {
  const XMLElement* given = nullptr;
  SE3 X;
  for (const Child& child : children) {
    if (getTag(*child.element) != "inertial") continue;
    if (given) refuse(*child.element, "the body has two inertias", "keep one");
    given = child.element;
    X = child.X_BF;
  }
  if (given && inertia_from_geom_ != "true") {
    MjcfElement e(*given, "", settings_);
    const Inertia inertia = readGivenInertia(e).transformed(X);
    const std::vector<SE3> frames(e.find("fullinertia") ? 0 : 1, X * e.getPose());
    soft.slides &= isOwnFrame(frames, inertia);
    soft.centre = inertia.com;
    return inertia;
  }
  if (given) noteElement(*given, "left out, because inertiafromgeom is true");
  if (inertia_from_geom_ == "false") return {};
  Inertia sum;
  std::vector<SE3> frames;
  for (const Child& child : children)
    if (getTag(*child.element) == "geom") sum = sum + readSolid(child, frames);
  soft.slides &= isOwnFrame(frames, sum);
  if (sum.mass > 0) soft.centre = sum.com;
  return sum;
}

Inertia MjcfReader::readGivenInertia(MjcfElement& e) const {
  if (!e.find("mass")) e.fail("it has no mass", "give one");
  const double mass = e.getNumber("mass", 0);
  if (!(mass >= 0)) e.fail("its mass is negative", "give 0 or more");
  if (!e.find("pos")) e.fail("it has no pos", "give the centre of mass");
  Matrix3d I = Matrix3d::Zero();
  const std::vector<double> diagonal = e.getNumbers("diaginertia", 3, 3), full = e.getNumbers("fullinertia", 6, 6);
  const SE3 X_BI = e.getPose();
  if (diagonal.empty() == full.empty())
    e.fail(full.empty() ? "it has no diaginertia or fullinertia" : "it has both diaginertia and fullinertia",
           "give one of them");
  if (!diagonal.empty()) I.diagonal() << diagonal[0], diagonal[1], diagonal[2];
  if (!full.empty()) {
    if (e.find("quat") || e.find("euler") || e.find("axisangle") || e.find("xyaxes") || e.find("zaxis"))
      e.fail("it has a fullinertia and an orientation", "keep one: fullinertia is in the axes of the body");
    I << full[0], full[3], full[4], full[3], full[1], full[5], full[4], full[5], full[2];
  }
  return Inertia{mass, Vector3d::Zero(), I}.transformed(X_BI);
}

// What <inertial> says by principal axes, to rounding; another one was changed since by hand.
void MjcfReader::readExactInertia(const XMLElement& element, const std::string& body) {
  MjcfElement e(element, "", settings_);
  const std::vector<double> data = e.getNumbers("data", 6, 6);
  const auto place = places_.find(body);
  if (data.empty() || place == places_.end()) return e.leaveOut("left out: there is no such body, or no data");
  Inertia& inertia = tree_.links.at(place->second.link).inertia;
  const Matrix3d& R = place->second.X_LB.R;
  if (!takeExactMoments(R * makeMoments(data) * R.transpose(), inertia.I_com))
    e.note("left out: the body has other moments of inertia");
}

// What <compiler> asks for: a mean moment where no body can have those given, and least values.
Inertia MjcfReader::keepBounds(const Inertia& inertia) const {
  if (!balances_inertia_ && least_mass_ <= 0 && least_moment_ <= 0) return inertia;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(inertia.I_com);
  Vector3d moments = principal.eigenvalues();  // in increasing order
  if (balances_inertia_ && moments[0] + moments[1] < moments[2]) moments.setConstant(moments.mean());
  moments = moments.cwiseMax(least_moment_);
  return {std::max(inertia.mass, least_mass_), inertia.com,
          principal.eigenvectors() * moments.asDiagonal() * principal.eigenvectors().transpose()};
}

void MjcfReader::scaleMasses() {
  if (!(total_mass_ > 0)) return;
  double mass = 0;
  for (const auto& [name, link] : tree_.links) mass += link.inertia.mass;
  if (!(mass > 0)) return;
  for (auto& [name, link] : tree_.links) {
    link.inertia.mass *= total_mass_ / mass;
    link.inertia.I_com *= total_mass_ / mass;
  }
}

// Volume, centre and moments per mass in the frame of its file.
Inertia MjcfReader::readMeshSolid(MjcfElement& e, const std::string& mesh) const {
  const std::string remedy =
      "give the body an <inertial>, as MuJoCo does when it saves the model, or the mesh as an STL or OBJ file";
  const auto asset = meshes_.find(mesh);
  if (asset == meshes_.end())
    e.fail("the mass of the body comes from the mesh '" + mesh + "', which is not there", remedy);
  std::string kind = asset->second.inertia;
  if (kind.empty()) kind = is_exact_ ? "exact" : "legacy";
  if (e.getFlag("shellinertia", false)) kind = "shell";
  if (kind != "exact" && kind != "legacy" && kind != "shell")
    e.fail("the mass of the body comes from the mesh '" + mesh + "' by its convex hull, which is not supported",
           "give the body an <inertial>, as MuJoCo does when it saves the model");
  const Visual& visual = asset->second.visual;
  const Eigen::Matrix3Xd corners =
      visual.size.asDiagonal() * asset->second.R_ref.transpose() *
      (readTriangles(visual.mesh, std::filesystem::path(settings_.path).parent_path().string()).colwise() -
       asset->second.p_ref);
  const std::optional<Inertia> solid = calcMeshInertia(corners, kind == "shell"   ? MeshSolid::Surface
                                                                : kind == "exact" ? MeshSolid::Enclosed
                                                                                  : MeshSolid::Overlapping);
  if (!solid)
    e.fail("the mass of the body comes from the mesh '" + mesh + "', but " + visual.mesh +
               " is missing, damaged, of another kind, or encloses nothing",
           remedy);
  const Inertia out{solid->mass, solid->com, solid->I_com / solid->mass};
  if (kind == "legacy" && !e.find("mass") && std::abs(calcBoxVolume(out.I_com) - out.mass) > 0.01 * out.mass)
    e.note(
        "its mass is that of its volume, as in MuJoCo 3; MuJoCo 2 takes the volume of a box with the same moments of "
        "inertia. Give the body an <inertial>, which all read alike");
  return out;
}

Inertia MjcfReader::readSolid(const Child& child, std::vector<SE3>& frames) {
  MjcfElement e(*child.element, child.childclass, settings_);
  const Shape shape = readShape(e, child.X_BF);
  for (const char* read : kGeomAttributes) e.find(read);
  const double density = e.getNumber("density", 1000), group = e.getNumber("group", 0), *given = nullptr;
  const double mass_given = e.getNumber("mass", -1);
  if (e.find("mass")) given = &mass_given;
  if ((given && !(*given >= 0)) || !(density >= 0)) e.fail("its mass or density is negative", "give 0 or more");
  if ((given ? *given : density) == 0 || shape.type == "plane" || shape.type == "hfield" || group < first_group_ ||
      group > last_group_)
    return {};
  const bool is_mesh = shape.type == "mesh";
  if (shape.type == "sdf" || (!is_mesh && (e.find("mesh") || e.getFlag("shellinertia", false))))
    e.fail("the mass of the body comes from this geom, whose " +
               std::string(shape.type == "sdf" ? "distance field"
                           : e.find("mesh")    ? "fit to a mesh"
                                               : "shell") +
               " is not supported",
           "give the body an <inertial>, as MuJoCo does when it saves the model");
  if (!is_mesh) frames.push_back(shape.X_BG);
  Inertia solid = is_mesh ? readMeshSolid(e, e.getText("mesh")) : calcPrimitive(e, shape);
  solid.mass = given ? *given : density * solid.mass;
  solid.I_com *= solid.mass;
  if (discards_visuals_ && solid.mass > 0 && e.getNumber("contype", 1) == 0 && e.getNumber("conaffinity", 1) == 0)
    e.note(
        "its mass counts, as in MuJoCo 3; MuJoCo 2 leaves it out (discardvisual). Give the body an <inertial>, which "
        "all read alike");
  return solid.transformed(shape.X_BG);
}

// Volume, and moments per mass about its own frame.
Inertia MjcfReader::calcPrimitive(const MjcfElement& e, const Shape& shape) {
  const std::optional<Inertia> solid = calcPrimitiveInertia(shape.type, {shape.size[0], shape.size[1], shape.size[2]});
  if (!solid)
    e.fail("its type '" + shape.type + "' is unknown", "use sphere, capsule, ellipsoid, cylinder, box, mesh or plane");
  return *solid;
}

}  // namespace bielle
