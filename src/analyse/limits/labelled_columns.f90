!> Columns of the trajectory table by their labels.
module nocdyn_labelled_columns
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: column_of, whole_moment_column

contains

  !> The last column with a label, 0 if there is none.
  pure integer function column_of(labels, label)
    type(string_t), intent(in) :: labels(:)
    character(len=*), intent(in) :: label

    do column_of = size(labels), 1, -1
      if (labels(column_of)%text == label) return
    end do
  end function column_of

  !> The column of the moment in a coupling, elastic and of its damping: without damping that is the elastic one.
  pure integer function whole_moment_column(labels, name) result(column)
    type(string_t), intent(in) :: labels(:)
    character(len=*), intent(in) :: name   !! of the coupling

    column = column_of(labels, 'shaft_' // name // ' [N m]')
    if (column == 0) column = column_of(labels, 'moment_' // name // ' [N m]')
  end function whole_moment_column

end module nocdyn_labelled_columns
