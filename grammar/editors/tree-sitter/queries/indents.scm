[(body) (look_block) (preview)] @indent.begin
"}" @indent.end @indent.branch
