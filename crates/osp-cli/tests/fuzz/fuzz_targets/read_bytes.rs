#![no_main]
osp_fuzz::fuzz!(read_bytes);
