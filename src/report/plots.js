'use strict';
// Which plots there are, and that they move together.

// Series by name over all runs: `list(run)` gives [{name, values, hidden, limits}], of a plan as well if it is `planned`.
function collectSeries(runs, list, planned) {
  const series = new Map();
  runs.forEach((run, r) => {
    for (const {name, values, hidden, limits} of list(run)) {
      if (!series.has(name))
        series.set(name, {name, hidden, limits, lines: runs.map(() => null), plans: runs.map(() => null)});
      series.get(name).lines[r] = values;
    }
    if (planned && run.plan)
      for (const {name, values} of list(run.plan)) series.get(name).plans[r] = values;
  });
  const all = Array.from(series.values()), colors = pickColors(all.map(item => item.name));
  all.forEach((item, i) => {
    item.color = item.color || colors[i];
  });
  return all;
}

const AXES = ['x', 'y', 'z'];

function hasLimit(limits) {
  return limits.some(limit => limit !== null && limit !== undefined);
}

// One-coordinate joints that `select` takes.
function listJoints(run, table, select, makeLimits) {
  return run.robot.joints.filter(joint => joint.nv === 1 && select(joint)).map(joint => {
    const limits = makeLimits(joint);
    return {
      name: joint.name,
      values: table.getColumn(joint[table === run.q ? 'q' : 'v']),
      limits: hasLimit(limits) ? limits : undefined
    };
  });
}

function isMotor(run, joint) {
  return run.robot.motors.some(motor => run.robot.joints[motor.joint] === joint);
}

function negate(limit) {
  return limit === null || limit === undefined ? null : -limit;
}

function scaleColumn(table, col, factor) {
  return table.getColumn(col).map(x => x * factor);
}

function listContactSeries(run, rows) {
  return [].concat(...run.robot.contacts.map((contact, c) => rows(contact, c)));
}

// [{title, unit, list, stairs, log, planned}]
function listPlots(runs) {
  const range = joint => [joint.lower, joint.upper], speed = joint => [negate(joint.velocity), joint.velocity];
  const hasSerial = runs.some(run => run.robot.joints.some(joint => joint.serial));
  return [
    {
      title: 'Centre of mass',
      planned: true,
      unit: 'm',
      list: run => AXES.map((axis, i) => ({name: axis, values: run.com.getColumn(i)}))
    },
    {
      title: 'Trunk tilt since the start',
      planned: true,
      unit: 'rad',
      list: run =>
          (run.robot.free ? ['roll', 'pitch', 'yaw'] : []).map((name, i) => ({name, values: run.tilt.getColumn(i)}))
    },
    {
      title: 'Feet',
      planned: true,
      unit: 'm',
      list: run => listContactSeries(
          run,
          (contact, c) => AXES.map(
              (axis, i) => ({name: contact.name + ' ' + axis, values: run.feet.getColumn(3 * c + i), hidden: i !== 2})))
    },
    {
      title: 'Contact forces',
      unit: 'N',
      stairs: true,
      list: run => listContactSeries(run, (contact, c) => AXES.map((axis, i) => ({
                                                                     name: contact.name + ' f' + axis,
                                                                     values: run.contact_wrenches.getColumn(6 * c + i),
                                                                     hidden: i !== 2
                                                                   })))
    },
    {title: 'Friction used', unit: 'tangential / normal', stairs: true, list: listFriction}, {
      title: 'Centres of pressure',
      unit: 'm',
      stairs: true,
      list: run => listContactSeries(
          run,
          (contact, c) => !contact.surface ?
              [] :
              [0, 1].map(i => ({
                           name: contact.name + ' ' + AXES[i],
                           values: run.pressure.getColumn(2 * c + i),
                           limits: [-1, 1].map(sign => sign * [contact.half_length, contact.half_width][i])
                         })))
    },
    {
      title: 'Motor torques',
      planned: true,
      unit: 'N m',
      stairs: true,
      list: run =>
          run.robot.motors.map((motor, m) => ({
                                 name: motor.name,
                                 values: run.u.getColumn(m),
                                 limits: hasLimit([motor.effort]) ? [negate(motor.effort), motor.effort] : undefined
                               }))
    },
    {
      title: 'Motor velocities',
      planned: true,
      unit: 'rad/s',
      list: run => run.robot.motors.map(
          motor => ({
            name: motor.name,
            values: run.v.getColumn(run.robot.joints[motor.joint].v),
            limits: hasLimit([motor.velocity]) ? [negate(motor.velocity), motor.velocity] : undefined
          }))
    },
    {title: 'Motor power', unit: 'W', stairs: true, list: listPower},
    {title: 'Motor angles', unit: 'rad', planned: true, list: run => listJoints(run, run.q, joint => isMotor(run, joint), range)}, {
      title: 'Joint angles',
      planned: true,
      unit: 'rad',
      list: run => listJoints(run, run.q, joint => (hasSerial ? joint.serial : !isMotor(run, joint)), range)
    },
    {
      title: 'Joint velocities',
      planned: true,
      unit: 'rad/s',
      list: run => listJoints(run, run.v, joint => (hasSerial ? joint.serial : !isMotor(run, joint)), speed)
    },
    {
      title: 'Energy',
      unit: 'J',
      list: run => ['kinetic', 'potential', 'sum'].map((name, i) => ({name, values: run.energy.getColumn(i)}))
    },
    {
      title: 'Distances from dead points',
      unit: 'rad',
      list: run => run.linkages.map((name, i) => ({name, values: run.dead_points.getColumn(i)}))
                       .filter(({values}) => values.some(Number.isFinite))
    },
    {
      title: 'Closure gaps',
      unit: 'm',
      log: true,
      list: run => listClosures(run, false, c => run.gaps.getColumn(2 * c))
    },
    {
      title: 'Closure forces',
      unit: 'N',
      stairs: true,
      list: run => listClosures(run, false, c => normOfColumns(run.closure_wrenches, 6 * c, 3))
    },
    {
      title: 'Coupler forces',
      unit: 'N m',
      stairs: true,
      list: run => listClosures(run, true, c => run.closure_wrenches.getColumn(6 * c))
    },
    {
      title: 'Predictive solves',
      unit: 'ms',
      stairs: true,
      list: run => listSolves(run, column => column !== 'time_s' && !SOLVER_COLUMNS.includes(column))
    },
    {
      title: 'Steps of these solves',
      unit: '0: none',
      stairs: true,
      list: run => listSolves(run, column => SOLVER_COLUMNS.includes(column))
    }
  ];
}

const SOLVER_COLUMNS = ['step', 'regularization'];

// Columns of the log of predictive control at every node, of the solve whose state was measured last. Parts are sums over
// all threads.
function listSolves(run, select) {
  const {log, log_columns} = run.summary.solves || {};
  if (!log) return [];
  return log_columns.filter(select).map(name => {
    const column = log_columns.indexOf(name), values = new Float32Array(run.time.length).fill(NaN);
    for (let k = 0, next = 0; k < values.length; ++k) {
      while (next < log.length && log[next][0] <= run.time[k] + 1e-6) ++next;
      if (next > 0) values[k] = log[next - 1][column];
    }
    return {name, values, hidden: !['whole', 'prepare', 'step'].includes(name)};
  });
}

// Values of all couplers, or of all other closures.
function listClosures(run, couplers, getValues) {
  return run.robot.closures.map((closure, c) => ({closure, c}))
      .filter(({closure}) => (closure.kind === 'coupler') === couplers)
      .map(({closure, c}) => ({name: closure.name, values: getValues(c)}));
}

function normOfColumns(table, col, count) {
  const out = new Float32Array(table.rows);
  for (let k = 0; k < table.rows; ++k) {
    let sum = 0;
    for (let i = 0; i < count; ++i) sum += table.get(k, col + i) ** 2;
    out[k] = Math.sqrt(sum);
  }
  return out;
}

// Torque at the beginning of a stage times the velocity there.
function listPower(run) {
  return run.robot.motors.map((motor, m) => {
    const v = run.robot.joints[motor.joint].v;
    return {name: motor.name, values: run.u.getColumn(m).map((u, k) => u * run.v.get(k, v))};
  });
}

function listFriction(run) {
  const friction = run.summary.ground && run.summary.ground.friction;
  return listContactSeries(run, (contact, c) => {
    const tangential = normOfColumns(run.contact_wrenches, 6 * c, 2);
    const values = tangential.map(
        (f, k) => (run.contact_wrenches.get(k, 6 * c + 2) > 1 ? f / run.contact_wrenches.get(k, 6 * c + 2) : NaN));
    return [{name: contact.name, values, limits: typeof friction === 'number' ? [null, friction] : undefined}];
  });
}

class Plots {
  // `onPick(t)`: a time was clicked.
  constructor(parent, runs, onPick) {
    const owner =
        {runs, onPick, onZoom: (plot, window) => this.zoom(plot, window), getBands: () => runs[0].getPhases()};
    this.plots = [];
    for (const definition of listPlots(runs)) {
      const series = collectSeries(runs, definition.list, definition.planned);
      if (series.length === 0) continue;
      const xs = runs.map(run => run.time);
      this.plots.push(new Plot(parent, Object.assign({}, definition, {series, xs}), owner));
    }
    this.end = Math.max(...runs.map(run => run.end));
  }

  zoom(source, [low, high]) {
    const whole = low <= 1e-6 && high >= this.end - 1e-6;
    for (const plot of this.plots)
      if (plot !== source || whole) plot.setWindow(whole ? null : [low, high]);
    source.placeCursor();
  }

  setTime(t) {
    for (const plot of this.plots) plot.setTime(t);
  }
}
