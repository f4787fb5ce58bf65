(cue "cue" @context number: (cue_number) @name label: (text)? @context.extra) @item
(part "part" @context (count) @name) @item
(bank "bank" @context name: (name) @name) @item
(look "look" @context name: (name) @name) @item
(group "group" @context name: (name) @name) @item
(light "light" @context name: (name) @name) @item
(point "point" @context name: (name) @name) @item
(view "view" @context name: (name) @name) @item
(curve "curve" @context name: (name) @name) @item
(effect "effect" @context name: (name) @name) @item
(let "let" @context name: (name) @name) @item
