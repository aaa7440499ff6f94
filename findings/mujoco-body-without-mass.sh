#!/bin/bash
# A loop that is closed at a body without mass is as soft as that body's frame was chosen: MuJoCo 2.2.2 and 3.14.0.
#
# Guessed: a connect between a tip (a body without inertia, fixed to an arm) and the world opens as far under gravity as the same
# connect at the arm itself, or a little less or more where the frame of the tip is moved: the pin stays where it is.
# Seen with MuJoCo 2.2.2 (Debian 12, libmujoco2.2.2 2.2.2-3) and 3.14.0 (npm, @mujoco/mujoco), alike to four digits:
# - the centre of mass of a body without <inertial> and without geoms (body_ipos) is its `pos`, which is in the frame of its parent,
#   taken in its own frame: a tip 0.4 m along the arm has its centre at 0.8 m;
# - softness is scaled by the inverse inertia at that centre (body_invweight0), so the pin opens by 0.30 mm at the arm, by 4.8 mm at a
#   tip 0.4 m along the arm, and by 1.2 mm at the same tip with an <inertial mass="0"> whose `pos` is 0 0 0.
# In version 3.14.0 a body whose only geoms have no mass is treated so, too; 2.2.2 puts its centre at the geom.
# Files of CAD programs have such bodies at each closure of a loop. Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq libmujoco-dev=2.2.2-3 libmujoco2.2.2=2.2.2-3 libccd2=2.1-2+b1 liblodepng0=0.0~git20220618.b4ed2cd-3 \
  libqhull-r8.0=2020.2-5 libtinyxml2-9=9.0.0+dfsg-3.1
for package in *.deb; do dpkg -x "$package" root; done
npm install --silent --no-fund --no-audit @mujoco/mujoco@3.14.0

# An arm of 2 kg, 0.2 m from its hinge to its centre, whose end at 0.4 m is pinned to the world.
make() { # BODY PLACE_OF_PIN_IN_IT CONTENTS
  cat <<XML
<mujoco><option timestep="0.001"/><worldbody><body name="arm"><joint axis="0 1 0"/>
<inertial pos="0.2 0 0" mass="2" diaginertia="0.01 0.03 0.03"/>$3</body></worldbody>
<equality><connect body1="$1" body2="world" anchor="$2" solref="0.05 1" solimp="0.9 0.9"/></equality></mujoco>
XML
}
make arm "0.4 0 0" "" >arm.xml
make tip "0 0 0" '<body name="tip" pos="0.4 0 0"/>' >tip.xml
make tip "0 0 0" '<body name="tip" pos="0.4 0 0"><inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/></body>' >zero.xml
make tip "0 0 0" '<body name="tip" pos="0.4 0 0"><geom size="0.01" pos="0.1 0 0" mass="0"/></body>' >geom.xml

cat > rest.c <<'C'
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
int main(int count, char** files) {
  for (int k = 1; k < count; ++k) {
    char error[500] = "";
    mjModel* model = mj_loadXML(files[k], 0, error, sizeof error);
    if (!model) return puts(error), 1;
    mjData* data = mj_makeData(model);
    while (data->time < 5) mj_step(model, data);
    mj_forward(model, data);
    const double* x = data->efc_pos;
    printf("%s %.2f %.2e\n", files[k], model->body_ipos[3 * (model->nbody - 1)], sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
  }
}
C
libraries=$(dirname "$(find root -name libmujoco.so.2.2.2)")
gcc rest.c -I root/usr/include -L "$libraries" -Wl,-rpath,"$PWD/$libraries" -l:libmujoco.so.2.2.2 -lm -o rest
cat > rest.mjs <<'JS'
import fs from "fs";
import load from "@mujoco/mujoco";
const mujoco = await load();
for (const name of process.argv.slice(2)) {
  mujoco.FS.writeFile(name, fs.readFileSync(name));
  const model = mujoco.MjModel.mj_loadXML(name), data = new mujoco.MjData(model);
  while (data.time < 5) mujoco.mj_step(model, data);
  mujoco.mj_forward(model, data);
  const [mantissa, exponent] = Math.hypot(...[...data.efc_pos].slice(0, 3)).toExponential(2).split("e");
  console.log(name, [...model.body_ipos][3 * (model.nbody - 1)].toFixed(2), `${mantissa}e-0${exponent.slice(1)}`);
}
JS
{ ./rest arm.xml tip.xml zero.xml geom.xml; node rest.mjs arm.xml tip.xml zero.xml geom.xml; } | tee seen
cat > expected <<'TEXT'
arm.xml 0.20 2.97e-04
tip.xml 0.40 4.76e-03
zero.xml 0.00 1.19e-03
geom.xml 0.10 1.86e-03
arm.xml 0.20 2.97e-04
tip.xml 0.40 4.76e-03
zero.xml 0.00 1.19e-03
geom.xml 0.40 4.76e-03
TEXT
diff expected seen && echo "as described"
