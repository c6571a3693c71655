use comfy_table::{Table, TableComponent, presets};

/// An empty table of columns, with a single line below its header.
pub fn columns_table() -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_HORIZONTAL_ONLY);
    table.remove_style(TableComponent::HorizontalLines);
    table.remove_style(TableComponent::MiddleIntersections);
    table
}
