# Converts the lines of VRPN's vrpn_print_devices to messages for `osp sketch --tracker -`.
# Sensor 0 is the head, sensor N is hand N. Hand 1 draws while button 0 of a device is pressed.
#
#   stdbuf -oL vrpn_print_devices Tracker0@trackerhost | awk -f vrpn.awk | osp sketch --tracker -

/^Tracker .*, sensor [0-9]+:/ {
    sensor = $0
    sub(/:.*/, "", sensor)
    sub(/.*sensor /, "", sensor)
}

/^Button .*, number 0 was just/ {
    pressure = /pressed/ ? 1 : 0
    # Repeats the last pose of the hand, because a button event has none.
    if (hand != "") print hand, pressure, 1
    fflush()
}

/pos \(/ && /quat \(/ {
    gsub(/[^-+.eE0-9]+/, " ")
    # The remaining words are the numbers: x y z, and the quaternion x y z w.
    count = 0
    for (i = 1; i <= NF; i++) if ($i ~ /^[-+]?[0-9.]/) number[++count] = $i
    if (count != 7) next
    pose = number[1] " " number[2] " " number[3] " " number[4] " " number[5] " " number[6] " " number[7]
    if (sensor == 0) {
        print "head", pose
    } else {
        line = "hand " pose
        if (sensor == 1) { hand = line; print line, pressure + 0, 1 } else print line, 0, sensor
    }
    fflush()
}
