'use strict';
// Tables of goals, results, checks and options.

function addTable(parent, head, rows) {
  const table = addElement(addElement(parent, 'div', 'scroll'), 'table');
  if (head) {
    const line = addElement(addElement(table, 'thead'), 'tr');
    for (const cell of head) addElement(line, 'th', '', cell);
  }
  const body = addElement(table, 'tbody');
  for (const row of rows) {
    const line = addElement(body, 'tr');
    for (const cell of row) {
      const shown = addElement(
          line, 'td', (cell && cell.className) || (typeof cell === 'number' ? 'number' : ''),
          typeof cell === 'number'              ? formatNumber(cell, 6) :
              (cell && cell.text !== undefined) ? cell.text :
                                                  String(cell === null || cell === undefined ? '–' : cell));
      if (cell && cell.note) addElement(shown, 'div', 'note', cell.note);
    }
  }
  return table;
}

// A value deep in an object, undefined when a step is missing.
function dig(object, ...keys) {
  return keys.reduce((value, key) => (value === null || value === undefined ? undefined : value[key]), object);
}

function makeTitle(runs) {
  const names = runs.map(run => (run.summary.motion || 'motion') + ' of ' + (run.summary.robot || run.robot.name));
  return Array.from(new Set(names)).join(' · ');
}

// Goals of a run, or of its plan: requested and achieved values.
function getGoals({summary}) {
  const goals = summary && Array.isArray(summary.goals) ? summary.goals : [];
  return goals.filter(goal => goal && typeof goal === 'object');
}

// Of a motion that was carried out: whether the robot stood. Of a solved one: how the solver ended.
function describeOutcome(run) {
  const {outcome, fall_time, termination} = run.summary;
  if (outcome === undefined) return termination || 'unknown';
  return typeof fall_time === 'number' ? outcome + ' at ' + fall_time.toFixed(3) + ' s' : outcome;
}

function fillBadges(parent, runs) {
  for (const run of runs) {
    const text = (runs.length > 1 ? run.label + ': ' : '') + describeOutcome(run);
    const {outcome, converged} = run.summary, isGood = outcome === undefined ? converged : outcome === 'stood' || outcome === 'ended';
    const judgement = outcome === 'running' ? '' : isGood ? 'good' : 'bad';
    addElement(parent, 'span', 'badge ' + judgement, text);
    if (outcome !== undefined)
      addElement(
          parent, 'span', 'badge',
          'world ' + run.summary.world + (run.summary.control ? ', control ' + run.summary.control : ''));
    const missed = getGoals(run).filter(goal => !goal.met).map(goal => goal.name);
    if (missed.length) addElement(parent, 'span', 'badge bad', 'missed: ' + missed.join(', '));
    if (run.check)
      addElement(
          parent, 'span', 'badge ' + (run.check.pass ? 'good' : 'bad'),
          run.check.pass ? 'check passed' : 'check failed');
  }
}

// Requested and achieved values side by side; of a motion that was carried out also those of its plan.
function fillGoals(parent, runs) {
  for (const run of runs.filter(r => getGoals(r).length)) {
    parent.hidden = false;
    if (runs.length > 1) addElement(parent, 'h2', '', run.label);
    const withUnit = (value, goal) =>
        typeof value === 'number' ? formatNumber(value) + (goal.unit === '1' ? '' : ' ' + goal.unit) : '–';
    const planned = getGoals({summary: run.summary.plan});
    const getPlanned = goal => planned.filter(other => other.name === goal.name).map(other => withUnit(other.achieved, goal));
    const rows = getGoals(run).map(
        goal =>
            [goal.name,
             goal.kind === 'footholds' ? 'within ' + withUnit(goal.tolerance, goal) : withUnit(goal.requested, goal),
             ...getPlanned(goal), withUnit(goal.achieved, goal),
             {text: goal.met ? 'met' : 'MISSED', className: goal.met ? 'pass' : 'fail'}]);
    addTable(parent, ['', 'requested', ...(planned.length ? ['planned'] : []), planned.length ? 'carried out' : 'achieved', ''], rows);
  }
}

// Of all linkages; undefined where there are none.
function describeNearestDeadPoint(run) {
  const linkages = (run.summary.dead_points || []).filter(linkage => typeof linkage.distance === 'number');
  const nearest = linkages.sort((a, b) => a.distance - b.distance)[0];
  return nearest &&
      nearest.linkage + ' ' + formatNumber(nearest.distance) + ' rad (or m) at ' + formatNumber(nearest.time_s) + ' s';
}

function fillSummary(parent, runs) {
  const units = (value, unit) => (typeof value === 'number' ? formatNumber(value) + ' ' + unit : undefined);
  const solved = read => run => (run.summary.outcome === undefined ? read(run) : undefined);
  const get = [
    [
      'outcome',
      run => [describeOutcome(run), run.summary.outcome_message || solved(r => r.summary.message)(run)]
                 .filter(text => text)
                 .join(': ')
    ],
    ['world', run => run.summary.world],
    ['control', run => run.summary.control],
    ['ground', run => run.summary.terrain],
    ['trunk deviation', run => units(run.summary.largest_deviation, 'm at most')],
    ['energy balance', run => units(dig(run.summary, 'books', 'imbalance_J'), 'J')],
    ['minimized', solved(run => dig(run.summary, 'objective', 'kind'))],
    ['cost', solved(run => run.summary.cost)],
    ['iterations', solved(run => run.summary.iterations)],
    ['solver time', solved(run => units(run.summary.seconds, 's'))],
    ['model', run => run.summary.model],
    ['formulation', run => run.summary.formulation],
    ['duration', run => units(run.summary.duration_s, 's') + ', ' + run.summary.nodes + ' nodes'],
    ['mass', run => units(run.robot.mass, 'kg')],
    ['centre of mass, start', run => units(dig(run.summary, 'com_height', 'start_m'), 'm high')],
    ['centre of mass, lowest', run => units(dig(run.summary, 'com_height', 'lowest_m'), 'm high')],
    ['largest closure gap', run => units(dig(run.summary, 'closure_gap', 'position_m'), 'm')],
    ['largest slip of a foot', run => units(dig(run.summary, 'contact_slip', 'position_m'), 'm')],
    ['nearest dead point', describeNearestDeadPoint],
    ['electrical energy', run => units(dig(run.summary, 'electrical_energy', 'total_J'), 'J')],
    ['cost of transport', run => dig(run.summary, 'electrical_energy', 'cost_of_transport')],
    ['friction coefficient', run => dig(run.summary, 'ground', 'friction')],
    [
      'peak torques',
      run => Object.entries(run.summary.peak_torques || {})
                 .slice(0, 4)
                 .map(([name, value]) => name + ' ' + formatNumber(value))
                 .join(', ')
    ]
  ];
  const rows = get.map(([name, read]) => [name, ...runs.map(read)])
                   .filter(row => row.slice(1).some(value => value !== undefined && value !== ''));
  addTable(parent, runs.length > 1 ? ['', ...runs.map(run => run.label)] : null, rows);
}

// Goals are met or missed, bounds hold or fail, notes are not judged.
function describeVerdict(row) {
  if (row.met !== undefined) return {text: row.met ? 'met' : 'MISSED', className: row.met ? 'pass' : 'fail'};
  return {text: row.pass ? 'pass' : 'FAIL', className: row.pass ? 'pass' : 'fail'};
}

// Value and bound with as many digits as a verdict of failure needs.
function formatCompared(row) {
  const numbers = [row.value, row.bound];
  let digits = 6;
  const format = value => (typeof value === 'number' ? formatNumber(value, digits) : '–');
  while (!row.pass && digits < 17 && numbers[0] !== numbers[1] && format(numbers[0]) === format(numbers[1])) ++digits;
  return numbers.map(value => ({text: format(value), className: typeof value === 'number' ? 'number' : ''}));
}

function addCheckTable(parent, rows) {
  addTable(
      parent, ['what, and where it is closest', 'value', 'bound', 'unit', ''],
      rows.map(row => [{text: row.name, note: row.note}, ...formatCompared(row), row.unit || '', describeVerdict(row)]));
}

// What failed or was missed; every row is in a table of its own at the end of the page.
function fillCheck(parent, everything, runs) {
  for (const run of runs.filter(r => r.check)) {
    parent.hidden = everything.hidden = document.getElementById('to-checks').hidden = false;
    const rows = run.check.rows || [], failed = rows.filter(row => describeVerdict(row).className === 'fail');
    for (const card of runs.length > 1 ? [parent, everything] : []) addElement(card, 'h2', '', run.label);
    if (failed.length) addCheckTable(parent, failed);
    const all = addElement(addElement(parent, 'p'), 'a', failed.length ? 'fail' : 'pass',
        failed.length ? failed.length + ' of ' + rows.length + ' rows failed or were missed' :
                        'All ' + rows.length + ' rows passed');
    all.href = '#checks';
    addCheckTable(everything, rows);
  }
}

// Cost, gap, violation and gradient over the iterations, and the whole log.
function fillIterations(parent, runs) {
  const logs = runs.map(run => (Array.isArray(run.summary.log) ? run.summary.log : []));
  if (logs.every(log => log.length === 0)) return;
  const columns = runs.map(run => run.summary.log_columns || []);
  const column = (r, name) => {
    const at = columns[r].indexOf(name);
    return at < 0 ? null : logs[r].map(line => line[at]);
  };
  const series = ['cost', 'gap', 'violation', 'gradient'].map(
      (name, i) => ({name, color: PALETTE[i], lines: runs.map((run, r) => column(r, name))}));
  new Plot(
      parent,
      {title: '', unit: '', log: true, points: true, xs: runs.map((run, r) => column(r, 'iteration') || []), series},
      {runs})
      .root.classList.remove('card');
  runs.forEach((run, r) => {
    const details = addElement(parent, 'details');
    addElement(
        details, 'summary', '', 'All ' + logs[r].length + ' iterations' + (runs.length > 1 ? ' of ' + run.label : ''));
    addTable(details, columns[r], logs[r]);
  });
}

function fillOptions(parent, runs) {
  const names = Array.from(new Set([].concat(...runs.map(run => Object.keys(run.summary.options || {})))));
  addTable(
      parent, runs.length > 1 ? ['', ...runs.map(run => run.label)] : null,
      names.map(name => [name, ...runs.map(run => dig(run.summary, 'options', name))]));
  for (const run of runs) {
    const command = run.summary.command;
    if (Array.isArray(command) && command.length) addElement(addElement(parent, 'p'), 'code', '', command.join(' '));
  }
}
