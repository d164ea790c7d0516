# usage: awk -f shaders.awk FOLDER/*.comp >gpu_shaders.h: each program's text as a C array, gpu_NAME_comp. In the text a line
# #include "FILE" is that file of the folder. #line says where lines are from: 0 is the program's own file; 1, 2 .. are those
# that it includes, in their order. An array of characters has no limit; that of a string is 4095 characters in C99.
function put(line) {
    gsub(/['\\]/, "\\\\&", line)
    gsub(/\\?./, "'&',", line)
    print line "'\\n',"
}
FNR == 1 {
    if (NR > 1) print "0};"
    folder = name = FILENAME
    sub(/[^\/]*$/, "", folder)
    sub(/.*\//, "", name)
    sub(/\.comp$/, "", name)
    print "static const char gpu_" name "_comp[] = {"
    files = 0
}
/^#include / {
    split($0, part, "\"")
    put("#line 1 " ++files)
    while ((got = (getline line < (folder part[2]))) > 0) put(line)
    if (got < 0) {
        print "shaders.awk: " FILENAME " includes " part[2] ", which cannot be read" >"/dev/stderr"
        exit 1
    }
    close(folder part[2])
    put("#line " FNR + 1 " 0")
    next
}
{ put($0) }
END { print "0};" }
