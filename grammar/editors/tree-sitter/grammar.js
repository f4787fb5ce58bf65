// Cue sheets (.lxq) for editors. The language is defined by ../../lxq.pest; this follows it so far
// that every sheet that is read there has a tree without errors here. It takes some that are refused
// there: names, units and ranges are the language server's.

const word = /[\p{Alphabetic}_][\p{Alphabetic}0-9_-]*/;

/// One of these words.
const words = (...all) => choice(...all);

/// One or more, between commas.
const listed = (rule) => seq(rule, repeat(seq(',', rule)));

module.exports = grammar({
  name: 'lxq',
  word: ($) => $.name,
  extras: ($) => [/[ \t\r\n]/, $.comment],
  supertypes: ($) => [$.statement],

  rules: {
    source_file: ($) => repeat($.statement),

    statement: ($) => choice(
      $.show, $.preview, $.include, $.gels, $.let, $.stage, $.surface, $.figure, $.haze, $.view, $.light,
      $.point, $.bank, $.fixed, $.group, $.look, $.default, $.curve, $.effect, $.cue,
    ),

    // ---- words, numbers, texts ----

    comment: () => token(choice(seq('//', /[^\n]*/), seq('/*', /[^*]*\*+([^/*][^*]*\*+)*/, '/'))),
    name: () => word,
    text: () => token(seq('"', /([^"\\\n]|\\.)*/, '"')),

    // A number with its unit; photometric units may stand off.
    _number: () => token(/[0-9]+(:[0-9]+)*(\.[0-9]*)?(%|\p{Alphabetic}+)?/),
    photometric_unit: () => choice('cd', 'lm', 'K', seq('cd', token.immediate('/m2'))),
    measure: ($) => seq($._number, optional(choice($.photometric_unit, token.immediate('/m2')))),
    number: ($) => prec.right(seq(optional('-'), $.measure)),
    _quantity: ($) => choice($.number, $.calculation),
    stops: ($) => seq('+', $._number),
    count: ($) => $._number,

    calculation: ($) => seq('(', choice($.colour, $._sum), ')'),
    _sum: ($) => choice($.binary, $._factor),
    binary: ($) => choice(
      prec.left(1, seq($._sum, choice('+', '-'), $._sum)),
      prec.left(2, seq($._sum, choice('*', '/'), $._sum)),
    ),
    _factor: ($) => choice($.measure, $.level_word, $.calculation, $.name, $.negative),
    negative: ($) => prec(3, seq('-', choice($.measure, $.level_word, $.calculation, $.name))),

    colour: () => token(choice(
      /#[\p{Alphabetic}0-9_-]*/,
      /hsb\([^)\n]*\)/,
      /gel[ \t]+[A-Za-z]?[A-Za-z]?[0-9]+/,
    )),
    _amount: ($) => choice($._quantity, $.colour),

    // ---- show, preview, let, stage, surface, haze, view ----

    show: ($) => seq('show', $.text),
    preview: ($) => seq('preview', '{', repeat($.preview_entry), '}'),
    preview_entry: ($) => seq(
      words('tolerance', 'gap', 'rate', 'exposure', 'white', 'tone', 'dither', 'coarse', 'refined'),
      choice(seq('auto', optional(choice($.stops, $.number))), words('filmic', 'plain'), words('on', 'off'),
        $.shown_steps, $._quantity, $.stops),
    ),
    shown_steps: ($) => seq($._number, words('steps')),
    include: ($) => seq('include', $.text),
    gels: ($) => seq('gels', $.text),
    let: ($) => seq('let', field('name', $.name), '=', choice($.colour, $._sum)),

    stage: ($) => seq('stage', $.text, repeat(choice(
      seq('z', 'up'), seq('y', 'up'), 'one-sided', 'matt', seq('scale', $._quantity), seq('at', $.position),
      seq('turn', $._quantity),
    ))),
    surface: ($) => seq('surface', $._material, repeat(choice(
      $.reflectance, seq('gloss', $._quantity), $.solid,
    ))),
    _material: ($) => choice($.text, field('name', $.name)),
    reflectance: ($) => seq('reflectance', choice(
      $.colour,
      seq($._quantity, optional(seq(optional(','), $._quantity, optional(','), $._quantity))),
    )),
    solid: ($) => prec.right(seq(
      choice(seq('quad', $.position, $.position, $.position, $.position), words('box', 'disc', 'cylinder', 'sphere')),
      repeat(choice(
        seq(words('from', 'to', 'at', 'aim'), $.position), seq('radius', $._quantity), seq('sides', $.count),
        'inside', 'two-sided',
      )),
    )),
    figure: ($) => seq('figure', repeat(choice(
      seq('at', $.position), seq(words('height', 'facing'), $._quantity),
    ))),
    haze: ($) => seq('haze', choice($.extinction, $._quantity),
      repeat(seq(words('forward', 'albedo'), $._quantity))),
    extinction: () => token(/-?[0-9]+(\.[0-9]+)?\/m/),
    view: ($) => seq('view', field('name', $.name), repeat(choice(
      seq('from', choice($.text, $.position)), seq('to', $.position),
      seq(words('fov', 'lens', 'roll'), $._quantity), seq('size', $.size),
    ))),
    position: ($) => seq($._quantity, ',', $._quantity, ',', $._quantity),
    size: () => token(/[0-9]+x[0-9]+|[0-9]+p|4k/),

    // ---- the rig ----

    light: ($) => seq('light', field('name', $.name), $.light_kind, repeat(choice(
      seq(words('at', 'from', 'aim'), $.position), seq(words('beam', 'field', 'radius', 'turn', 'speed'), $._quantity),
      words('moves', 'standing'), seq(words('pan', 'tilt', 'zoom'), $._quantity, 'to', $._quantity), $.colour, $._quantity,
    ))),
    light_kind: ($) => choice(
      words('spot', 'sphere', 'disc'), seq('panel', choice($.text, $.name)),
      seq(words('photometric', 'project', 'from', 'lantern'), $.text), seq('like', $.name),
    ),
    point: ($) => seq('point', field('name', $.name), '=', $.position),
    bank: ($) => seq('bank', field('name', $.name), optional(choice($.image, seq('=', $.names))), repeat(choice(
      seq('channel', $.count), seq('dimmer', $.name), 'rgb',
    ))),
    image: ($) => seq('image', $.text, optional(seq('layer', $.text))),
    names: ($) => repeat1($.name),
    fixed: ($) => seq('fixed', field('name', $.name), choice($.image, seq('=', $.names)),
      optional(seq('level', $._value))),
    group: ($) => seq('group', field('name', $.name), '=', $.names),
    look: ($) => seq('look', field('name', $.name), choice(
      $.look_block,
      seq('=', $._look_term, repeat(seq('+', $._look_term))),
    )),
    _look_term: ($) => choice($.look_block, $.name),
    look_block: ($) => seq('{', repeat($.look_level), '}'),
    look_level: ($) => seq($.target, optional('to'), $._value, optional($._value)),
    target: ($) => seq($.name, optional(seq(token.immediate('.'), token.immediate(/[rgb]/)))),
    _value: ($) => choice($._quantity, $.colour, $.level_word),
    level_word: () => words('full', 'out'),

    // ---- curves, paths, effects ----

    curve: ($) => seq('curve', field('name', $.name), '=', $.path),
    path: ($) => seq(
      choice(seq('spline', optional($.spline_kind)), $.spline_kind, 'linear', 'steps'),
      listed($.knot),
    ),
    spline_kind: () => words('natural', 'clamped', 'catmull-rom', 'monotone', 'hermite', 'bezier'),
    knot: ($) => seq($._quantity, $._value,
      optional(choice(seq('slope', $._quantity), seq('via', $._quantity, $._quantity)))),
    effect: ($) => seq('effect', field('name', $.name), '=', words('flicker', 'pulse'), repeat(choice(
      seq(words('rate', 'depth'), $._quantity), seq('seed', $.count),
    ))),

    // ---- cues ----

    default: ($) => seq('default', $.time),
    cue: ($) => seq('cue', field('number', $.cue_number), optional(field('label', $.text)), optional($.at), $.body),
    cue_number: ($) => $._number,
    at: ($) => seq('at', $._amount),
    body: ($) => seq('{', repeat($._item), '}'),
    _item: ($) => choice(
      $.movement, $.note, $.time, $.part, $.timing, $.fade, $.at, $.flag, $.blackout, $.snap,
    ),
    part: ($) => seq('part', $.count, optional($.text), $.body),
    time: ($) => seq('time', $._amount, optional(seq('/', $._amount))),
    timing: ($) => choice(seq(words('up', 'down', 'delay', 'follow', 'hang'), $._amount), seq('repeat', $.count)),
    snap: () => 'snap',
    fade: ($) => seq('curve', $.name),
    flag: () => words('block', 'assert', 'cueonly'),
    note: ($) => seq('note', $.text),
    blackout: () => 'blackout',
    aim: ($) => prec.right(seq('to', choice($.position, $.name), repeat($.angle))),
    angle: ($) => seq(words('pan', 'tilt', 'beam', 'field'), $._quantity),
    movement: ($) => prec.right(seq(
      $.target,
      optional(choice(
        seq(optional('to'), $._value, optional($._value), optional($.aim)),
        $.aim,
        repeat1($.angle),
        $.path,
        repeat1(seq('+', $._look_term)),
      )),
      optional(seq('effect', $.name, optional('spread'))),
    )),
  },
});
