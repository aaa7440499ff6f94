'use strict';
// The page of a data set: every motion as a picture, with what was asked and what was achieved.
// Data: {title, about, motions: [a line of index.jsonl, with {shortfall, picture: SVG or ''}]}.

const CHOICES = {
  robot: motion => motion.robot,
  payload: motion => motion.payload_kg + ' kg',
  motion: motion => motion.motion,
  outcome: motion => (motion.good ? 'good' : 'not good')
};

class DatasetPage {
  constructor(data) {
    Object.assign(this, data);
    document.title = this.title + ' – Bielle';
    this.lists = Object.entries(CHOICES).map(([name, read]) => this.addChoice(name, read)).filter(list => list);
    this.cards = this.motions.map(motion => this.addCard(document.getElementById('motions'), motion));
    document.getElementById('footer').textContent = this.about;
    this.choose();
  }

  // Nothing is to be chosen where all are alike.
  addChoice(name, read) {
    const values = Array.from(new Set(this.motions.map(read)));
    if (values.length < 2) return null;
    const list = addElement(document.getElementById('choices'), 'select');
    list.title = name;
    addElement(list, 'option', '', 'any ' + name).value = '';
    for (const value of values) addElement(list, 'option', '', value).value = value;
    list.onchange = () => this.choose();
    return {list, read};
  }

  choose() {
    const chosen = this.motions.filter((motion, i) => {
      const fits = this.lists.every(({list, read}) => list.value === '' || list.value === read(motion));
      this.cards[i].hidden = !fits;
      return fits;
    });
    document.getElementById('title').textContent =
        this.title + ': ' + chosen.filter(motion => motion.good).length + ' of ' + chosen.length + ' motions are good';
  }

  addCard(parent, motion) {
    const card = addElement(parent, 'div', 'card motion');
    card.id = motion.name;
    const load = motion.payload_kg > 0 ? ' with ' + motion.payload_kg + ' kg' : '';
    addElement(card, 'h2', '', motion.motion + ', ' + motion.robot + load);
    if (motion.picture) {
      const drawing = new DOMParser().parseFromString(motion.picture, 'image/svg+xml').documentElement;
      card.append(document.adoptNode(drawing));
    }
    const asked = Object.entries({...motion.set, ...motion.options, ...motion.simulate});
    addElement(card, 'p', '', asked.map(([name, value]) => name + ' ' + value).join(', '));
    const withUnit = ({unit}, value) => formatNumber(value) + (unit === '1' ? '' : ' ' + unit);
    const goals = motion.goals.filter(goal => typeof goal.achieved === 'number' && !(goal.name === 'footholds' && goal.met));
    addElement(card, 'p', '', ['achieved: ' + (goals.map(goal => goal.name + ' ' + withUnit(goal, goal.achieved)).join(', ') || '–'),
                               formatNumber(motion.duration_s) + ' s', motion.outcome].filter(text => text).join('; '));
    if (!motion.good) addElement(card, 'p', 'bad', motion.shortfall);
    const files = addElement(card, 'p');
    for (const [format, path] of Object.entries(motion.files)) {
      addElement(files, 'a', '', format).href = path;
      files.append(' ');
    }
    return card;
  }
}

const datasetPage = new DatasetPage(JSON.parse(document.getElementById('data').textContent));
