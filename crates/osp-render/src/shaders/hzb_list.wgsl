// Lists the polygons of a mask: bit i is polygon `first` + i.
fn list_bits(place: u32, first: u32, mask: u32) {
    var to = place;
    var bits = mask;
    while bits != 0u {
        list[to] = first + firstTrailingBit(bits);
        bits &= bits - 1u;
        to += 1u;
    }
}
