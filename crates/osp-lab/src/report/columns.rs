use comfy_table::{Table, TableComponent, presets};

/// Returns an empty table whose only rule is below the column names.
pub fn columns_table() -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_HORIZONTAL_ONLY);
    table.remove_style(TableComponent::HorizontalLines);
    table.remove_style(TableComponent::MiddleIntersections);
    table
}
